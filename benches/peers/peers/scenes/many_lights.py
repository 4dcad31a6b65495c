"""Ten thousand small emitting triangles: 2,500 lamps of four, in sixteen colours and strengths over two decades."""

from __future__ import annotations

import numpy as np

from ..model import Camera, Diffuse, Mesh, Scene
from ..shapes import box, quad, tetrahedra

GROUPS = 16


def build() -> Scene:
    """Lamps hang in clusters over a field of blocks, above the picture: near ones matter and most do not."""
    rng = np.random.default_rng(4)
    meshes = [Mesh("ground", *quad((-20, 0, 20), (20, 0, 20), (20, 0, -20), (-20, 0, -20)), Diffuse((0.5, 0.5, 0.5)))]
    for number in range(60):
        x, z = rng.uniform(-14, 14, 2)
        half = rng.uniform((0.3, 0.2, 0.3), (1.0, 1.6, 1.0))
        colour = rng.uniform(0.25, 0.8, 3)
        points, faces = box((float(x), float(half[1]), float(z)), tuple(half), float(rng.uniform(0, 90)))
        meshes.append(Mesh(f"block{number}", points, faces, Diffuse((float(colour[0]), float(colour[1]), float(colour[2])))))
    for group in range(GROUPS):
        lamps = 2500 // GROUPS + (1 if group < 2500 % GROUPS else 0)
        middle = rng.uniform((-12, 7.5, -12), (12, 9.0, 12))
        centres = np.float32(middle + rng.normal(size=(lamps, 3)) * (3.0, 0.25, 3.0))
        strength = 2000.0 * 10 ** (-2.0 * group / (GROUPS - 1))
        colour = 0.4 + 0.6 * rng.uniform(size=3)
        emission = (float(strength * colour[0]), float(strength * colour[1]), float(strength * colour[2]))
        meshes.append(Mesh(f"lamps{group}", *tetrahedra(centres, 0.02, group), emission=emission))
    return Scene("many-lights", "10,000 emitting triangles", Camera((0, 6.5, 15), (0, 0, 2.5), 38, 384, 256), meshes, 4, (8, 32))
