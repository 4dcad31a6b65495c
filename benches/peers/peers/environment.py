"""One sky in the three projections that the renderers want, each sampled from the same function of the direction."""

from __future__ import annotations

from typing import Callable

import numpy as np

from .model import Floats

Sky = Callable[[Floats], Floats]


def equal_area(sky: Sky, size: int) -> Floats:
    """pbrt-v4: a square, equal-area octahedral (Clarberg 2008), z towards the middle of the square."""
    x, y = _grid(size, size)
    u, v = 2 * x - 1, 2 * y - 1
    up, vp = np.abs(u), np.abs(v)
    signed = 1 - (up + vp)
    d = np.abs(signed)
    r = 1 - d
    phi = np.where(r == 0, 1.0, (vp - up) / np.where(r == 0, 1, r) + 1) * np.pi / 4
    z = np.copysign(1 - r * r, signed)
    scale = r * np.sqrt(np.maximum(0, 2 - r * r))
    direction = np.stack([np.copysign(np.cos(phi), u) * scale, np.copysign(np.sin(phi), v) * scale, z], -1)
    return _sample(sky, direction)


def latitude_longitude(sky: Sky, width: int) -> Floats:
    """Mitsuba 3: y up, the middle column towards +z, the first towards -z."""
    u, v = _grid(width, width // 2)
    theta, phi = np.pi * v, 2 * np.pi * u
    direction = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], -1)
    return _sample(sky, direction)


def blender(sky: Sky, width: int) -> Floats:
    """Cycles: the poles along z, whatever is up in the scene; first row on top."""
    u, v = _grid(width, width // 2)
    phi, theta = -2 * np.pi * (u - 0.5), np.pi * (0.5 - v)
    direction = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)], -1)
    return _sample(sky, direction)


def _grid(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return x, y


def _sample(sky: Sky, direction: np.ndarray) -> Floats:
    flat = sky(direction.reshape(-1, 3).astype(np.float32))
    return flat.reshape(*direction.shape[:2], 3).astype(np.float32)
