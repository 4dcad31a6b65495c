"""Pictures on surfaces: a ground and balls with image textures."""

from __future__ import annotations

import numpy as np

from ..model import Camera, Diffuse, Mesh, Scene, Texture
from ..shapes import blob, quad


def _cloth(size: int, seed: int) -> np.ndarray:
    """Smooth waves and a weave, in 8-bit sRGB."""
    rng = np.random.default_rng(seed)
    y, x = np.meshgrid(np.arange(size) / size, np.arange(size) / size, indexing="ij")
    channels = []
    for _ in range(3):
        value = np.zeros((size, size))
        for octave in range(5):
            kx, ky = rng.integers(1, 4, 2) * 2**octave
            value += np.sin(2 * np.pi * (kx * x + rng.uniform())) * np.sin(2 * np.pi * (ky * y + rng.uniform())) / 1.6**octave
        channels.append(0.55 + 0.2 * value / 1.5)
    weave = 0.1 * np.sign(np.sin(64 * np.pi * x) * np.sin(64 * np.pi * y))
    return np.uint8(np.clip(np.stack(channels, -1) + weave[..., None], 0.05, 0.95) * 255)


def build() -> Scene:
    """A large square lamp above, textures of 1024 x 1024."""
    points, faces = quad((-8, 0, 8), (8, 0, 8), (8, 0, -8), (-8, 0, -8))
    uv = np.array([[0, 0], [2, 0], [2, 2], [0, 2]], np.float32)
    meshes = [
        Mesh("ground", points, faces, Diffuse(Texture("ground", _cloth(1024, 1))), uv=uv),
        Mesh("wall", *quad((-8, 0, -4), (8, 0, -4), (8, 9, -4), (-8, 9, -4)), Diffuse(Texture("wall", _cloth(1024, 2))),
             uv=np.array([[0, 0], [1.5, 0], [1.5, 1], [0, 1]], np.float32)),
        Mesh("lamp", *quad((-2, 6, -1.5), (1, 6, -1.5), (1, 6, 1.5), (-2, 6, 1.5)), emission=(12.0, 12.0, 12.0)),
        Mesh("shade", *quad((-2.1, 6.002, 1.6), (1.1, 6.002, 1.6), (1.1, 6.002, -1.6), (-2.1, 6.002, -1.6))),
    ]
    for number, x in enumerate((-2.2, 0.0, 2.2)):
        points, faces, uv = blob((x, 1.0, 0.3 - 0.5 * abs(x)), 1.0, 60_000, 0.03, number)
        meshes.append(Mesh(f"ball{number}", points, faces, Diffuse(Texture(f"ball{number}", _cloth(1024, 3 + number))), uv=uv))
    return Scene("textured", "Image textures", Camera((0, 3.2, 9.5), (0, 1.1, 0), 32, 384, 256), meshes, 5, (8, 32))
