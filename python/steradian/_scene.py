"""Scenes and renders."""

from __future__ import annotations

import os
import queue
import sys
import threading
from collections.abc import Iterator, Mapping
from typing import Any, Callable, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _steradian as _native
from ._image import Image
from ._words import words
from .errors import Diagnostic, InputError

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[dict[str, Any]], None]


class Scene:
    """A scene that can be changed and rendered.

    Its numbers have names: ``scene["camera.fov"] = 30``, ``scene["materials.wall.reflectance"] = [0.8, 0.2, 0.1]``. ``scene.keys()``
    lists them, and Tab completes them in notebooks.
    """

    def __init__(self, native: _native.Scene) -> None:
        self._native = native

    @property
    def name(self) -> str:
        """How a person would name it."""
        return self._native.name

    @property
    def hash(self) -> str:
        """A hash of everything that was read, and of what was changed since."""
        return self._native.hash

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture that the scene asks for."""
        return self._native.size

    @property
    def warnings(self) -> list[Diagnostic]:
        """What was noticed while reading."""
        return [Diagnostic(**report) for report in self._native.warnings]

    def parameters(self) -> dict[str, Any]:
        """All names with their values. A texture that varies over a surface has no value and no name."""
        return self._native.parameters()

    def keys(self) -> list[str]:
        """The names of all parameters."""
        return list(self.parameters())

    def __iter__(self) -> Iterator[str]:
        return iter(self.parameters())

    def __len__(self) -> int:
        return len(self.parameters())

    def __contains__(self, name: object) -> bool:
        return name in self.parameters()

    def __getitem__(self, name: str) -> Any:
        parameters = self.parameters()
        if name not in parameters:
            raise KeyError(_unknown(name, list(parameters)))
        return parameters[name]

    def __setitem__(self, name: str, value: Any) -> None:
        if name not in self:
            raise KeyError(_unknown(name, self.keys()))
        self._native.set(name, value)

    def update(self, values: Mapping[str, Any]) -> None:
        """Sets several parameters."""
        for name, value in values.items():
            self[name] = value

    def _ipython_key_completions_(self) -> list[str]:
        return self.keys()

    def look_at(self, eye: npt.ArrayLike, target: npt.ArrayLike, up: npt.ArrayLike = (0.0, 1.0, 0.0)) -> None:
        """Puts the camera at ``eye`` and points it at ``target``."""
        e, t, u = (np.asarray(v, dtype=np.float64) for v in (eye, target, up))
        forward = t - e
        length = np.linalg.norm(forward)
        right = np.cross(u, forward)
        if length == 0.0 or np.linalg.norm(right) == 0.0:
            raise InputError("eye and target must differ, and up must not be parallel to the view")
        forward, right = forward / length, right / np.linalg.norm(right)
        matrix = np.eye(4)
        # A camera looks along its z axis. An existing mirroring stays.
        old = np.asarray(self["camera.to_world"], dtype=np.float64)
        mirror = -1.0 if np.linalg.det(old[:3, :3]) < 0.0 else 1.0
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = mirror * right, np.cross(forward, right), forward, e
        self._native.set("camera.to_world", matrix.tolist())

    def copy(self) -> Scene:
        """A scene of its own with the same content."""
        return Scene(self._native.copy())

    def pack(self) -> bytes:
        """The scene with all its files and changes, for another machine."""
        return self._native.pack()

    @staticmethod
    def unpack(packed: bytes) -> Scene:
        """A scene from the bytes of :meth:`pack`; no file of this machine is read."""
        return Scene(_native.Scene.unpack(packed))

    def render(self, **options: Any) -> Image:
        """See :func:`steradian.render`."""
        return render(self, **options)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<steradian.Scene {self.name!r}, {width} x {height}>"


def _unknown(name: str, names: list[str]) -> str:
    import difflib

    near = difflib.get_close_matches(name, names, n=3)
    hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else ""
    return f"there is no parameter {name!r}{hint}"


def load(path: Optional[Path] = None, **options: Any) -> Scene:
    """Reads a pbrt-v4 scene, a Mitsuba scene or a model; without ``path``, the scene that is built in.

    ``options`` are those of the command line about models: ``env="park.hdr"``, ``camera=1``, ``define={"spp": 16}``.
    Raises :class:`SceneError` with every problem of the scene.
    """
    if path is None:
        return Scene(_native.Scene.showcase())
    return Scene(_native.Scene.from_file(os.fspath(path), words(options)))


def loads(text: str, name: str = "<string>", files: Optional[Mapping[str, bytes]] = None) -> Scene:
    """Reads a pbrt-v4 text. Files that it names may be given as bytes; others are looked for in the current folder."""
    return Scene(_native.Scene.from_text(name, text, dict(files or {})))


class _Bar:
    """A line that says how far it has come, on terminals and in notebooks."""

    def __init__(self) -> None:
        self._drawn = 0

    def __call__(self, p: dict[str, Any]) -> None:
        done = int(24 * p["fraction"])
        left = p["seconds_left"]
        text = f"[{'=' * done}{' ' * (24 - done)}] {100 * p['fraction']:3.0f} %  {p['samples_per_pixel']} spp"
        if left is not None:
            text += f"  {left:.0f} s left"
        sys.stderr.write("\r" + text.ljust(self._drawn))
        sys.stderr.flush()
        self._drawn = len(text)

    def clear(self) -> None:
        if self._drawn:
            sys.stderr.write("\r" + " " * self._drawn + "\r")
            sys.stderr.flush()


def _shown() -> bool:
    if "ipykernel" in sys.modules:
        return True
    return bool(getattr(sys.stderr, "isatty", lambda: False)())


def _split(scene: Union[Scene, Path, None]) -> Scene:
    return scene if isinstance(scene, Scene) else load(scene)


def render(scene: Union[Scene, Path, None] = None, *, progress: Union[bool, Progress, None] = None, **options: Any) -> Image:
    """Renders a scene, or a file, or without one the scene that is built in.

    Options are those of ``steradian render``, with underscores: ``spp=64``, ``integrator="path"``, ``size=(640, 360)``, ``seed=1``,
    ``aovs=["albedo", "normal"]``, ``threads=2``, ``light_sampling=False``, ``error=0.01``, ``time=60``. Each replaces what the scene says.
    ``progress`` is called with a dictionary now and then; True and False turn a bar on and off, which is on in terminals and notebooks.
    Other Python threads run meanwhile, and Ctrl-C works.
    """
    held = _split(scene)
    bar = _Bar() if progress is True or (progress is None and _shown()) else None
    hear = progress if callable(progress) else bar
    try:
        return Image(held._native.render(words(options), hear))
    finally:
        if bar:
            bar.clear()


def render_progressive(scene: Union[Scene, Path, None] = None, **options: Any) -> Iterator[Image]:
    """Renders as :func:`render`, and gives the picture as it stands after each pass; the last one has all samples and layers.

    Whoever is slow skips passes. Leaving the loop ends the render.
    """
    held = _split(scene)
    frames: queue.Queue[Any] = queue.Queue(maxsize=1)
    stop = threading.Event()

    def show(native: _native.Image) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        try:
            frames.put_nowait(Image(native))
        except queue.Full:
            pass

    def beat(_: dict[str, Any]) -> None:
        if stop.is_set():
            raise KeyboardInterrupt

    last: list[Any] = []

    def work() -> None:
        try:
            last.append(Image(held._native.render(words(options), beat, show)))
        except BaseException as e:  # noqa: B902 - it is raised again where somebody sees it
            last.append(e)
        frames.put(None)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        while (frame := frames.get()) is not None:
            yield frame
        if isinstance(last[0], BaseException):
            raise last[0]
        yield last[0]
    finally:
        stop.set()
        while thread.is_alive():
            # Makes room for the thread's last word.
            try:
                frames.get_nowait()
            except queue.Empty:
                thread.join(0.05)
