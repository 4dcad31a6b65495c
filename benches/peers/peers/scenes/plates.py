"""Plates of growing roughness under lamps of growing size, after Veach (1997, figure 9.2): where sampling lights alone, or lobes
alone, fails."""

from __future__ import annotations

import numpy as np

from ..model import Camera, Conductor, Diffuse, Mesh, Scene
from ..shapes import quad

Vector = np.ndarray


def _facing(centre: Vector, normal: Vector, across: float, along: float) -> tuple:
    """A rectangle about `centre` that faces `normal`; `across` and `along` are halves of its sides, the first level."""
    normal = normal / np.linalg.norm(normal)
    right = np.cross([0.0, 1.0, 0.0], normal)
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)
    corners = [centre + s * across * right + t * along * up for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return quad(*(tuple(float(x) for x in corner) for corner in corners))


def build() -> Scene:
    """Each plate is turned so that it mirrors the lamps to the camera."""
    eye = np.array([0.0, 2.0, 15.0])
    lamps = np.array([0.0, 6.0, 0.0])
    meshes = [
        Mesh("floor", *quad((-12, -4.5, 12), (12, -4.5, 12), (12, -4.5, -6), (-12, -4.5, -6)), Diffuse((0.4, 0.4, 0.4))),
        Mesh("wall", *quad((-12, -4.5, -6), (12, -4.5, -6), (12, 12, -6), (-12, 12, -6)), Diffuse((0.4, 0.4, 0.4))),
    ]
    for number, (alpha, y, z) in enumerate([(0.01, 1.2, 0.5), (0.03, -0.6, 2.0), (0.08, -2.1, 3.6), (0.2, -3.3, 5.4)]):
        centre = np.array([0.0, y, z])
        to_eye, to_lamp = eye - centre, lamps - centre
        normal = to_eye / np.linalg.norm(to_eye) + to_lamp / np.linalg.norm(to_lamp)
        meshes.append(Mesh(f"plate{number}", *_facing(centre, normal, 4.0, 0.7), Conductor((0.75, 0.8, 0.85), alpha)))
    # The same power from each: a lamp of half the side shines four times as brightly.
    middle = np.array([0.0, -1.0, 3.0])
    for number, (x, half) in enumerate([(-3.9, 0.05), (-1.6, 0.2), (0.9, 0.5), (3.9, 0.9)]):
        centre = lamps + [x, 0, 0]
        radiance = 4.0 / half**2
        colour = [(1.0, 0.75, 0.6), (0.7, 1.0, 0.75), (0.65, 0.8, 1.0), (1.0, 0.95, 0.7)][number]
        emission = (radiance * colour[0], radiance * colour[1], radiance * colour[2])
        towards = (middle - centre) / np.linalg.norm(middle - centre)
        meshes.append(Mesh(f"lamp{number}", *_facing(centre, towards, half, half), emission=emission))
        # Renderers disagree about the back of a lamp, so each has a black plate close behind it.
        meshes.append(Mesh(f"shade{number}", *_facing(centre - 0.001 * towards, towards, half + 0.02, half + 0.02)))
    return Scene("plates", "Veach's plates", Camera((0, 2, 15), (0, 0.3, 0), 46, 384, 256), meshes, 5, (16, 64))
