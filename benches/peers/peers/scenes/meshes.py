"""Bumpy balls of one million and of eight million triangles in all: where trees, memory and loading count."""

from __future__ import annotations

from ..model import Camera, Conductor, Diffuse, Mesh, Scene
from ..shapes import blob, quad


def build_1m() -> Scene:
    """Four balls of 250,000 triangles."""
    return _build("mesh-1m", "1 M triangles", 4, 250_000)


def build_8m() -> Scene:
    """Eight balls of a million triangles."""
    return _build("mesh-8m", "8 M triangles", 8, 1_000_000)


def _build(name: str, sentence: str, balls: int, triangles: int) -> Scene:
    meshes = [
        Mesh("ground", *quad((-30, 0, 30), (30, 0, 30), (30, 0, -30), (-30, 0, -30)), Diffuse((0.5, 0.5, 0.5))),
        Mesh("wall", *quad((-30, 0, -8), (30, 0, -8), (30, 20, -8), (-30, 20, -8)), Diffuse((0.55, 0.6, 0.65))),
        Mesh("lamp", *quad((-3, 9, -1), (1, 9, -1), (1, 9, 3), (-3, 9, 3)), emission=(14.0, 13.0, 12.0)),
        Mesh("shade", *quad((-3.1, 9.002, 3.1), (1.1, 9.002, 3.1), (1.1, 9.002, -1.1), (-3.1, 9.002, -1.1))),
    ]
    across = balls // 2
    for number in range(balls):
        x = (number % across - (across - 1) / 2) * 2.6
        z = 1.5 - 3.0 * (number // across)
        points, faces, _ = blob((x, 1.3, z), 1.15, triangles, 0.06, number)
        material = Conductor((0.95, 0.75, 0.4), 0.2) if number % 4 == 1 else Diffuse([(0.7, 0.3, 0.2), (0.3, 0.5, 0.7), (0.6, 0.6, 0.3)][number % 3])
        meshes.append(Mesh(f"ball{number}", points, faces, material))
    return Scene(name, sentence, Camera((0.5, 4.5, 13), (0, 1.2, -0.5), 28 if balls < 8 else 36, 384, 256), meshes, 5, (8, 32))
