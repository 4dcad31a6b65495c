"""Renders on a Ray cluster, to the bytes of a render on one machine.

The scene, with all files that it reads, goes to each node once. Every part is a task of its own that Ray repeats if its worker or its node dies;
finished parts are kept on the driver's disk, so that the same call goes on with them after the driver died.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import statistics
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Callable, Optional, Union

from . import _steradian as _native
from ._image import Image
from ._scene import Scene, load
from ._words import words as _words
from .errors import InputError, MachineError, SteradianError

# A worker that dies is no news on a large cluster.
_TRIES = 8
# Parts for each that renders: so many that the last ones do not keep all others waiting (docs/cluster.md has the numbers).
_PARTS_PER_CORE = 16
# A part that takes this many times as long as others is rendered a second time, if somebody is idle.
_PATIENCE = 1.5
_LEAST_PATIENCE = 1.0
_PREVIEW_PAUSE = 2.0
_SLOTS_PAUSE = 5.0

# The scene that this worker rendered a part of last.
_held: dict[str, Scene] = {}


def _render_part(key: str, packed: bytes, words: list[str], what: str) -> bytes:
    """What a worker does: a part as the command line renders it, one of a round (light only, cut by samples), or what a part sees besides."""
    if key not in _held:
        _held.clear()
        _held[key] = Scene.unpack(packed)
    native = _held[key]._native
    if what == "seen":
        return native.seen(words)
    return native.part(words, what == "round", what == "round")


def _ray() -> Any:
    try:
        import ray
    except ImportError:
        raise MachineError(f"Ray is not installed: {sys.executable} -m pip install ray") from None
    return ray


@contextlib.contextmanager
def _connected(address: Optional[str]) -> Iterator[Any]:
    """Ray, as it runs, or started for this render."""
    ray = _ray()
    if ray.is_initialized():
        yield ray
        return
    try:
        ray.init(address=address, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    except ConnectionError as e:
        raise MachineError(f"there is no Ray at {address}: {e}") from None
    try:
        yield ray
    finally:
        ray.shutdown()


class _Parts:
    """The parts of one render, on disk."""

    def __init__(self, folder: Path, count: int) -> None:
        self.folder, self.count = folder, count

    def path(self, number: int) -> Path:
        return self.folder / f"{number:05}-of-{self.count:05}.part"

    def missing(self) -> list[int]:
        return [i for i in range(1, self.count + 1) if not self.path(i).exists()]

    def keep(self, number: int, content: bytes) -> None:
        # Under its name a part is whole.
        with tempfile.NamedTemporaryFile(dir=self.folder, delete=False) as f:
            f.write(content)
            f.flush()
            os.fsync(f.fileno())
        os.replace(f.name, self.path(number))

    def there(self) -> list[Path]:
        return [p for i in range(1, self.count + 1) if (p := self.path(i)).exists()]


def _count(folder: Path, wanted: Optional[int], cores: int) -> int:
    """In how many parts: as was asked, or as an earlier call began."""
    if wanted is None:
        counts = {int(p.stem.split("-of-")[1]) for p in folder.glob("*-of-*.part")}
        if len(counts) == 1:
            return counts.pop()
    return wanted or max(1, cores) * _PARTS_PER_CORE


class _Driver:
    def __init__(
        self,
        ray: Any,
        scene: Scene,
        words: list[str],
        threads: int,
        hear: Optional[Callable[[float, int, int], None]],
        see: Optional[Callable[[Callable[[], Image]], None]],
    ) -> None:
        self.ray, self.scene, self.words, self.hear, self.see = ray, scene, words, hear, see
        self.key, self.threads = scene.hash, threads
        self.packed: Any = None
        # What earlier rounds left for the preview, and the words that they are of.
        self.before: list[Path] = []
        self.rounds: Optional[list[str]] = None
        options = {"num_cpus": threads, "max_retries": _TRIES, "retry_exceptions": [MachineError]}
        self.task = ray.remote(**options)(_render_part)

    def run(self, parts: _Parts, words_of: Callable[[int], tuple[list[str], str]]) -> None:
        """Renders what is missing."""
        missing = parts.missing()
        if self.hear:
            self.hear(1.0 - len(missing) / parts.count, parts.count - len(missing), parts.count)
        if not missing:
            return
        if self.packed is None:
            # Into the object store once; nodes take it from there and from each other.
            self.packed = self.ray.put(self.scene.pack())
        queue = deque(missing)
        under_way: dict[Any, tuple[int, float]] = {}
        took: list[float] = []
        shown = asked = 0.0
        slots = 1
        try:
            while queue or under_way:
                now = time.monotonic()
                if now >= asked:
                    # Nodes come and go.
                    slots, asked = self.slots(), now + _SLOTS_PAUSE
                # A few more than can run, so that nobody waits for the next one.
                while queue and len(under_way) < slots + slots // 4 + 1:
                    self.begin(queue.popleft(), under_way, words_of)
                if not queue:
                    for i in self.late(under_way, took, slots):
                        self.begin(i, under_way, words_of)
                ready, _ = self.ray.wait(list(under_way), num_returns=1, timeout=0.5)
                for reference in ready:
                    i, began = under_way.pop(reference)
                    try:
                        content = self.ray.get(reference)
                    except self.ray.exceptions.RayTaskError as e:
                        raise _cause(e) from None
                    except self.ray.exceptions.RayError as e:
                        raise MachineError(f"part {i} of {parts.count} was lost for good: {e}") from None
                    parts.keep(i, content)
                    took.append(time.monotonic() - began)
                    for other in [r for r, (j, _) in under_way.items() if j == i]:
                        del under_way[other]
                        self.ray.cancel(other)
                left = len(queue) + len({i for i, _ in under_way.values()})
                if ready and self.hear:
                    self.hear(1.0 - left / parts.count, parts.count - left, parts.count)
                if ready and self.see and left and time.monotonic() > shown:
                    start = time.monotonic()
                    self.see(lambda: _joined([*self.before, *parts.there()], partial=True, rounds=self.rounds)[0])
                    shown = time.monotonic() + max(_PREVIEW_PAUSE, 20.0 * (time.monotonic() - start))
        finally:
            for reference in under_way:
                self.ray.cancel(reference)

    def begin(
        self, number: int, under_way: dict[Any, tuple[int, float]], words_of: Callable[[int], tuple[list[str], str]]
    ) -> None:
        under_way[self.task.remote(self.key, self.packed, *words_of(number))] = (number, time.monotonic())

    def slots(self) -> int:
        """How many parts the cluster renders at a time."""
        return max(1, int(self.ray.cluster_resources().get("CPU", 1)) // self.threads)

    @staticmethod
    def late(under_way: Mapping[Any, tuple[int, float]], took: Sequence[float], slots: int) -> list[int]:
        """The parts that take too long, where somebody is idle who could render them a second time: both give the same bytes."""
        if not took or len(under_way) >= slots:
            return []
        limit = time.monotonic() - _PATIENCE * statistics.median(took) - _LEAST_PATIENCE
        numbers = [i for i, _ in under_way.values()]
        late = sorted((began, i) for i, began in under_way.values() if began < limit and numbers.count(i) == 1)
        return [i for _, i in late[: slots - len(under_way)]]


def _cause(error: Any) -> BaseException:
    cause = getattr(error, "cause", None)
    if isinstance(cause, SteradianError):
        return cause
    return MachineError(f"a worker failed: {error}")


def _joined(
    parts: Sequence[Path],
    *,
    partial: bool = False,
    rounds: Optional[Sequence[str]] = None,
    look: int = 0,
    seen: Sequence[Path] = (),
) -> tuple[Image, float, Optional[list[float]]]:
    read = [[p.read_bytes() for p in paths] for paths in (parts, seen)]
    image, complete, bound = _native.join_parts(read[0], partial, None if rounds is None else list(rounds), look, read[1])
    return Image(image), complete, bound


def _round_shards(first: int, end: int, most: int) -> list[str]:
    """Shards ``I/N`` by samples that cover samples ``first`` to ``end`` of ``end``, about ``most`` of them."""
    size = end - first
    pieces = 1
    while 2 * pieces <= most and size % (2 * pieces) == 0:
        pieces *= 2
    count = pieces * end // size
    return [f"{count - pieces + i + 1}/{count}" for i in range(pieces)]


def _split(words: list[str], names: Sequence[str]) -> tuple[list[str], list[str]]:
    """The options of these names with their values, and all others."""
    taken, rest, i = [], [], 0
    while i < len(words):
        if words[i].split("=")[0] in names:
            step = 1 if "=" in words[i] else 2
            taken += words[i : i + step]
            i += step
        else:
            rest.append(words[i])
            i += 1
    return taken, rest


class _Result:
    def __init__(self, image: Image, files: list[Path], folder: Path, rounds: bool, spp: Optional[int], bound: Optional[float]) -> None:
        self.image, self.files, self.folder, self.rounds, self.spp, self.bound = image, files, folder, rounds, spp, bound

    def clean(self) -> None:
        """Takes the parts away, which are in the picture now."""
        for path in self.files:
            path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            self.folder.rmdir()


def _run(
    scene: Scene,
    words: list[str],
    spp: Optional[int],
    *,
    address: Optional[str],
    parts: Optional[int],
    spill: Path,
    threads: int,
    hear: Optional[Callable[[float, int, int], None]],
    see: Optional[Callable[[Callable[[], Image]], None]],
) -> _Result:
    # The driver looks at the error; parts know nothing of it.
    goal, rest = _split([w for w in words if w != "--no-adaptive"], ("--error", "--error-in", "--error-pixels", "--confidence"))
    key = hashlib.blake2s("\n".join([_native.__version__, scene.hash, *rest]).encode(), digest_size=8).hexdigest()
    folder = spill / key
    folder.mkdir(parents=True, exist_ok=True)
    base = [*rest, f"--threads={threads}"]
    with _connected(address) as ray:
        driver = _Driver(ray, scene, rest, threads, hear, see)
        cores = int(ray.cluster_resources().get("CPU", 1)) // threads
        if not goal:
            kept = _Parts(folder, _count(folder, parts, cores))
            driver.run(kept, lambda i: ([*base, f"--shard={i}/{kept.count}"], "part"))
            files = kept.there()
            return _Result(_joined(files)[0], files, folder, False, None, None)
        # Rounds end where a render here would look at its error, and go on from each other.
        driver.rounds = said = [*rest, *goal, "--no-adaptive"]
        laid_out = spp or int(scene["sampler.spp"])
        base = _split(base, ("--spp", "--sampler-spp"))[1]
        most = parts or max(1, cores) * _PARTS_PER_CORE
        first, files = 0, []
        ends = _native.looks(spp or 1 << 20) or []
        if spp and (not ends or ends[-1][0] < spp):
            ends = [*ends, (spp, ends[-1][1] + 1 if ends else 1)]

        def shared(name: str, end: int, shards: list[str], what: str) -> list[Path]:
            inner = folder / name
            inner.mkdir(exist_ok=True)
            kept = _Parts(inner, len(shards))
            to_end = [*base, f"--spp={end}", f"--sampler-spp={laid_out}"]
            driver.run(kept, lambda i: ([*to_end, f"--shard={shards[i - 1]}"], what))
            return kept.there()

        looks_again = scene._native.looks_again(rest)
        for end, look in ends:
            files += shared(f"{end:07}", end, _round_shards(first, end, most), "round")
            image, _, bound = _joined(files, rounds=said, look=look)
            if bound is not None and bound[0] <= bound[1]:
                break
            first, driver.before = end, list(files)
        if looks_again:
            # The end is known now, and with it how often a pixel is looked at.
            driver.see = None
            seen = shared(f"seen-{end:07}", end, [f"{i}/{most}" for i in range(1, most + 1)], "seen")
            image, _, bound = _joined(files, rounds=said, look=look, seen=seen)
            files += seen
        return _Result(image, files, folder, True, end, bound[0] if bound else None)


def render(
    scene: Union[Scene, str, "os.PathLike[str]", None] = None,
    *,
    address: Optional[str] = None,
    parts: Optional[int] = None,
    spill: Union[str, "os.PathLike[str]", None] = None,
    threads: int = 1,
    progress: Optional[Callable[[float], None]] = None,
    preview: Union[Callable[[Image], None], str, "os.PathLike[str]", None] = None,
    **options: Any,
) -> Image:
    """Renders as :func:`steradian.render`, on the Ray cluster at ``address``, on the one that runs, or on one started for this.

    ``parts`` is how many tasks there are, ``threads`` the cores of each. Finished parts are kept in ``spill`` (a folder for temporary files by
    default): after a crash of this process, the same call with the same folder goes on with them. ``preview`` is a function or a file that gets
    the picture as it stands. ``error=0.01`` renders in rounds until the error is below that everywhere it is promised, and no further.
    """
    held = scene if isinstance(scene, Scene) else load(scene)
    see: Optional[Callable[[Callable[[], Image]], None]] = None
    if callable(preview):
        show = preview
        see = lambda picture: show(picture())  # noqa: E731
    elif preview is not None:
        file = os.fspath(preview)
        see = lambda picture: picture().write(file)  # noqa: E731
    for name in ("time", "adaptive", "denoise", "checkpoint"):
        if options.get(name):
            raise InputError(f"{name!r} does not go with rendering on an engine")
    spp = options.get("spp")
    hear = (lambda fraction, *_: progress(fraction)) if progress else None
    kept = Path(spill) if spill is not None else Path(tempfile.gettempdir()) / "steradian-parts"
    result = _run(
        held,
        _words(options),
        int(spp) if spp else None,
        address=address,
        parts=parts,
        spill=kept,
        threads=threads,
        hear=hear,
        see=see,
    )
    result.clean()
    return result.image


def _command(argv: list[str]) -> int:
    """What ``steradian render --engine ray`` does: the words of that command without ``render``."""
    asked: Mapping[str, Any] = _native.asked(argv)
    if not asked["writing"] or "-o" not in asked["writing"]:
        raise InputError("-o FILE says where the picture goes")

    def say(line: str) -> None:
        if line and not asked["quiet"]:
            print(line, file=sys.stderr, flush=True)

    path = asked["scene"]
    native = _native.Scene.showcase() if path is None else _native.Scene.from_file(os.fspath(path), list(asked["reading"]))
    scene = Scene(native)
    outputs = [w for before, w in zip(asked["writing"], asked["writing"][1:]) if before == "-o"]
    spill = Path(asked["spill"]) if asked["spill"] else Path(outputs[0]).parent / "steradian-parts"
    start = time.monotonic()

    def hear(_: float, done: int, count: int) -> None:
        say(f"{done} of {count} parts, {time.monotonic() - start:.0f} s")

    preview = asked["preview"]
    see = (lambda picture: picture().write(os.fspath(preview))) if preview else None
    result = _run(
        scene,
        list(asked["words"]),
        asked["spp"],
        address=asked["address"],
        parts=asked["parts"],
        spill=spill,
        threads=asked["threads"] or 1,
        hear=hear,
        see=see,
    )
    if result.rounds:
        _native.write_outputs(result.image._native, list(asked["writing"]))
        say(f"{result.spp} samples per pixel, error bound {result.bound:.3g}" if result.bound else "")
        code = 0
    else:
        quiet = ["--quiet"] if asked["quiet"] else []
        code = _native.run(["merge", *map(str, result.files), *asked["writing"], *quiet])
    if code == 0:
        result.clean()
        with contextlib.suppress(OSError):
            spill.rmdir()
    return code


def _main() -> int:
    try:
        return _command(sys.argv[1:])
    except SteradianError as e:
        print(f"error: {e}", file=sys.stderr)
        return 3 if isinstance(e, MachineError) else 2
    except KeyboardInterrupt:
        print("stopped; the same command goes on with the parts that are there", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(_main())
