"""The Cornell box (Goral et al. 1984), with the proportions and colours of its measured successor."""

from __future__ import annotations

import numpy as np

from ..model import Camera, Diffuse, Mesh, Scene
from ..shapes import box, quad

WHITE = Diffuse((0.725, 0.71, 0.68))


def build() -> Scene:
    """512 x 512, eight bounces. The lamp fills a hole in the ceiling, so that its back cannot be seen."""
    x0, x1, z0, z1 = -0.24, 0.23, -0.16, 0.22
    ceiling = np.array([[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1], [x0, 2, z0], [x1, 2, z0], [x1, 2, z1], [x0, 2, z1]], np.float32)
    frame = np.array([[0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]], np.uint32)
    meshes = [
        Mesh("floor", *quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)), WHITE),
        Mesh("ceiling", ceiling, frame, WHITE),
        Mesh("back", *quad((-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1)), WHITE),
        Mesh("left", *quad((-1, 0, 1), (-1, 0, -1), (-1, 2, -1), (-1, 2, 1)), Diffuse((0.63, 0.065, 0.05))),
        Mesh("right", *quad((1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1)), Diffuse((0.14, 0.45, 0.091))),
        Mesh("short", *box((0.35, 0.3, 0.35), (0.3, 0.3, 0.3), -17), WHITE),
        Mesh("tall", *box((-0.35, 0.6, -0.3), (0.3, 0.6, 0.3), 17), WHITE),
        Mesh("lamp", *quad((x0, 2, z0), (x1, 2, z0), (x1, 2, z1), (x0, 2, z1)), emission=(17.0, 12.0, 4.0)),
    ]
    return Scene("cornell", "Cornell box, 512 x 512", Camera((0, 1, 6.8), (0, 1, 0), 19.5, 512, 512), meshes, 8, (4, 16))
