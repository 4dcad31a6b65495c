"""A homogeneous medium: a box of fog with blocks in it, lit from above."""

from __future__ import annotations

from ..model import Camera, Diffuse, Fog, Mesh, Scene
from ..shapes import box, quad


def build() -> Scene:
    """The boundary of the fog is invisible; the lamp and the camera are outside."""
    meshes = [
        Mesh("ground", *quad((-6, -0.02, 6), (6, -0.02, 6), (6, -0.02, -6), (-6, -0.02, -6)), Diffuse((0.5, 0.5, 0.5))),
        Mesh("fog", *box((0, 1.5, 0), (2.2, 1.5, 2.2)), Fog((0.02, 0.03, 0.05), (0.5, 0.5, 0.5), 0.3)),
        Mesh("tall", *box((-0.6, 1.0, -0.5), (0.4, 0.95, 0.4), 20), Diffuse((0.7, 0.3, 0.2))),
        Mesh("short", *box((0.7, 0.5, 0.6), (0.4, 0.45, 0.4), -15), Diffuse((0.3, 0.5, 0.7))),
        Mesh("lamp", *quad((-1, 5, -1), (0.4, 5, -1), (0.4, 5, 0.4), (-1, 5, 0.4)), emission=(60.0, 55.0, 45.0)),
        Mesh("shade", *quad((-1.1, 5.002, 0.5), (0.5, 5.002, 0.5), (0.5, 5.002, -1.1), (-1.1, 5.002, -1.1))),
    ]
    return Scene("fog", "Homogeneous medium", Camera((0.5, 3.0, 9), (0, 1.3, 0), 36, 288, 192), meshes, 8, (8, 32))
