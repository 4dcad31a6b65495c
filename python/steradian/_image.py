"""Pictures."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _steradian as _native

Array = npt.NDArray[np.float32]

# The order of channels in an array; others follow by name.
_ORDER = {name: i for i, name in enumerate("RGBAXYZUVuv")}


class Image:
    """A picture: linear light in R, G, B, and other layers by name.

    ``numpy.asarray(image)`` is height x width x 3 (4 where there is alpha), 32-bit floats, row 0 at the top.
    ``image["albedo"]`` is the layer of that name, height x width x channels, or height x width where it has one.
    """

    def __init__(self, native: _native.Image) -> None:
        self._native = native

    @staticmethod
    def read(path: Union[str, "os.PathLike[str]"]) -> Image:
        """Reads .exr, .png, .jpg, .hdr, .pfm and others; what is not linear is made so."""
        return Image(_native.Image.read(os.fspath(path)))

    @staticmethod
    def from_array(array: npt.ArrayLike) -> Image:
        """From height x width (grey) or height x width x 1, 3 or 4 values of linear light."""
        values = np.asarray(array, dtype=np.float32)
        if values.ndim == 2:
            values = values[:, :, None]
        if values.ndim != 3 or values.shape[2] not in (1, 3, 4):
            raise ValueError(f"a picture has height x width x 1, 3 or 4 values, not {values.shape}")
        names = ["Y"] if values.shape[2] == 1 else list("RGBA"[: values.shape[2]])
        return Image(_native.Image.from_array(values, names))

    @property
    def width(self) -> int:
        """Pixels in a row."""
        return self._native.size[0]

    @property
    def height(self) -> int:
        """Rows."""
        return self._native.size[1]

    @property
    def channels(self) -> list[str]:
        """The names of all channels, as in the file."""
        return self._native.channels

    @property
    def layers(self) -> dict[str, list[str]]:
        """Channels by layer; the picture itself has the name ``""``."""
        out: dict[str, list[str]] = {}
        for name in self.channels:
            layer = name.rpartition(".")[0]
            # Depth and the like stand alone.
            if not layer and name not in ("R", "G", "B", "A", "Y"):
                layer = name
            out.setdefault(layer, []).append(name)
        for names in out.values():
            names.sort(key=lambda n: (_ORDER.get(n.rpartition(".")[2], 99), n))
        return out

    def keys(self) -> list[str]:
        """The names of the layers."""
        return list(self.layers)

    def __iter__(self) -> Iterator[str]:
        return iter(self.layers)

    def __contains__(self, name: object) -> bool:
        return name in self.layers or name in self.channels

    def __getitem__(self, name: str) -> Array:
        """A layer or a channel."""
        names = self.layers.get(name) or ([name] if name in self.channels else None)
        if names is None:
            raise KeyError(f"there is no layer {name!r}; there are {', '.join(map(repr, self.layers))}")
        values: Array = self._native.stack(names)
        return values[:, :, 0] if len(names) == 1 else values

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.layers)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the array."""
        return (self.height, self.width, len(self.layers.get("", [])))

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        values: npt.NDArray[Any] = self._native.stack(self.layers.get("", []))
        return values if dtype is None else values.astype(dtype)

    @property
    def metadata(self) -> dict[str, Any]:
        """What the picture says about itself: scene, options, seed, samples, time."""
        return self._native.metadata

    @property
    def outcome(self) -> Optional[str]:
        """Why rendering ended: ``finished``, ``error reached``, ``time limit`` or ``interrupted``; None for a picture from elsewhere."""
        return self._native.outcome

    @property
    def bad_samples(self) -> int:
        """How many samples went wrong and counted as black."""
        return self._native.bad_samples

    def write(
        self,
        path: Union[str, "os.PathLike[str]"],
        *,
        tonemap: str = "agx",
        exposure: Union[float, str] = 0.0,
    ) -> None:
        """Writes a file, whole or not at all: .exr, .hdr and .pfm hold light as it is, .png and .jpg are tone mapped."""
        auto = exposure == "auto"
        self._native.write(os.fspath(path), tonemap, None if auto else float(exposure), auto)

    def tonemapped(self, operator: str = "agx", exposure: Union[float, str] = 0.0) -> Array:
        """What a screen shows, sRGB-encoded, height x width x 3, in [0, 1]."""
        linear = tonemap(self, operator, exposure)
        low = linear * 12.92
        high = 1.055 * np.power(np.maximum(linear, 0.0031308), 1.0 / 2.4) - 0.055
        return np.where(linear <= 0.0031308, low, high).astype(np.float32)

    def _repr_png_(self) -> bytes:
        return self._native.encode("picture.png", "agx", 0.0, False)

    def __repr__(self) -> str:
        layers = ", ".join(repr(n) for n in self.layers if n)
        beside = f", layers {layers}" if layers else ""
        return f"<steradian.Image {self.width} x {self.height}{beside}>"


def _light(image: Any) -> Array:
    values = np.asarray(image, dtype=np.float32)
    if values.ndim == 3 and values.shape[2] > 3:
        values = values[:, :, :3]
    return np.ascontiguousarray(values)


def tonemap(image: Any, operator: str = "agx", exposure: Union[float, str] = 0.0) -> Array:
    """Linear light to what a screen shows, still linear, in [0, 1]: clip, reinhard, hable, aces or agx."""
    return _native.tonemap(_light(image), operator, None if exposure == "auto" else float(exposure))


def compare(image: Any, reference: Any) -> dict[str, Any]:
    """Whether two pictures show the same, statistically, and how far apart they are: agree, mse, rel_mse, psnr, flip, bias."""
    pair = [i if isinstance(i, Image) else Image.from_array(i) for i in (image, reference)]
    return _native.compare(pair[0]._native, pair[1]._native)


def write(path: Union[str, "os.PathLike[str]"], image: Any, **options: Any) -> None:
    """Writes an array or an image; see :meth:`Image.write`."""
    (image if isinstance(image, Image) else Image.from_array(image)).write(path, **options)


def read(path: Union[str, "os.PathLike[str]"]) -> Image:
    """Reads a picture."""
    return Image.read(path)
