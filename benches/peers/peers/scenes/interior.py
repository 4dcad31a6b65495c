"""A room with metal and glass, lit by a sky through a wall that is open."""

from __future__ import annotations

import numpy as np

from ..model import Camera, Conductor, Dielectric, Diffuse, Floats, Mesh, Scene
from ..shapes import blob, box, quad


def sky(direction: Floats) -> Floats:
    """Blue above, warm below, and a wide soft sun."""
    d = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    height = 0.5 + 0.5 * d[:, 1:2]
    base = (1 - height) * np.array([0.55, 0.45, 0.35]) + height * np.array([0.5, 0.8, 1.3])
    sun = np.array([0.75, 0.5, 0.43]) / np.linalg.norm([0.75, 0.5, 0.43])
    lobe = np.exp(60.0 * (d @ sun - 1.0))[:, None]
    return (base + lobe * np.array([22.0, 18.0, 12.0])).astype(np.float32)


def build() -> Scene:
    """The right wall has a window from floor to ceiling; the camera stands in the room."""
    wall = Diffuse((0.75, 0.72, 0.68))
    meshes = [
        Mesh("floor", *quad((-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)), Diffuse((0.45, 0.33, 0.22))),
        Mesh("ceiling", *quad((-3, 3, -3), (3, 3, -3), (3, 3, 3), (-3, 3, 3)), wall),
        Mesh("back", *quad((-3, 0, -3), (3, 0, -3), (3, 3, -3), (-3, 3, -3)), wall),
        Mesh("front", *quad((3, 0, 3), (-3, 0, 3), (-3, 3, 3), (3, 3, 3)), wall),
        Mesh("left", *quad((-3, 0, 3), (-3, 0, -3), (-3, 3, -3), (-3, 3, 3)), Diffuse((0.3, 0.45, 0.6))),
        Mesh("right", *quad((3, 0, -3), (3, 0, -1.6), (3, 3, -1.6), (3, 3, -3)), wall),
        Mesh("table", *box((0, 0.35, -0.6), (1.9, 0.35, 0.7)), Diffuse((0.2, 0.15, 0.12))),
        Mesh("mirror", *box((-1.6, 1.5, -2.9), (0.8, 1.0, 0.05)), Conductor((0.9, 0.9, 0.9), 0.0)),
        Mesh("tray", *box((0.2, 0.72, -0.3), (0.9, 0.015, 0.3)), Conductor((0.9, 0.75, 0.45), 0.1)),
    ]
    balls = [
        ("gold", (-1.2, 1.1, -0.7), 0.4, Conductor((0.95, 0.7, 0.35), 0.2)),
        ("steel", (1.3, 1.05, -0.8), 0.35, Conductor((0.6, 0.58, 0.55), 0.05)),
        ("glass", (-0.3, 1.1, -0.5), 0.35, Dielectric(1.5, 0.0)),
        ("frosted", (0.55, 1.06, -0.6), 0.32, Dielectric(1.5, 0.25)),
    ]
    for name, centre, radius, material in balls:
        points, faces, _ = blob(centre, radius, 20_000, 0.0, 0)
        meshes.append(Mesh(name, points, faces, material))
    return Scene("interior", "Metal and glass in a room, environment light", Camera((0.3, 1.5, 2.8), (0, 1.1, -0.8), 42, 384, 256), meshes,
                 8, (8, 32), sky)
