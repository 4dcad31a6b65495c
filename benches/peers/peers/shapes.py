"""Meshes by formula."""

from __future__ import annotations

import numpy as np

from .model import Floats, Indices


def quad(a: tuple[float, float, float], b: tuple[float, float, float], c: tuple[float, float, float],
         d: tuple[float, float, float]) -> tuple[Floats, Indices]:
    """A quadrilateral with counter-clockwise corners."""
    return np.array([a, b, c, d], np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def box(centre: tuple[float, float, float], half: tuple[float, float, float], turn: float = 0.0) -> tuple[Floats, Indices]:
    """A closed box, turned by so many degrees about the y axis, faces outwards."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64) * half
    angle = np.radians(turn)
    rotation = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    points = corners @ rotation.T + centre
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    return points.astype(np.float32), np.array(faces, np.uint32)


def blob(centre: tuple[float, float, float], radius: float, triangles: int, bump: float, seed: int) -> tuple[Floats, Indices, Floats]:
    """A closed ball of about so many triangles, with bumps of relative height `bump`: points, faces, uv."""
    columns = max(8, int(round(np.sqrt(triangles))))
    rows = max(4, triangles // (2 * columns) + 1)
    u = np.arange(columns + 1) / columns
    v = np.arange(1, rows) / rows
    uu, vv = np.meshgrid(u, v)
    uv = np.concatenate([np.stack([uu, vv], -1).reshape(-1, 2), [[0.5, 0.0], [0.5, 1.0]]])
    # The seam is where u is 0 and 1: the same sines, so that it closes to the bit.
    phi = 2 * np.pi * np.where(uv[:, 0] == 1.0, 0.0, uv[:, 0])
    theta = np.pi * uv[:, 1]
    around = np.where((uv[:, 1] == 0) | (uv[:, 1] == 1), 0.0, np.sin(theta))
    direction = np.stack([around * np.cos(phi), -np.cos(theta), -around * np.sin(phi)], -1)
    height = np.zeros(len(uv))
    if bump:
        rng = np.random.default_rng(seed)
        for octave in range(6):
            waves = rng.normal(size=(3, 3)) * 3.0 * 1.9**octave
            shifts = rng.uniform(0, 2 * np.pi, 3)
            height += np.prod(np.sin(direction @ waves.T + shifts), axis=1) / 1.7**octave
    points = np.asarray(centre) + radius * (1.0 + bump * height)[:, None] * direction
    row = np.arange(rows - 2)[:, None] * (columns + 1)
    a = (row + np.arange(columns)[None, :]).ravel()
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    south, north = len(uv) - 2, len(uv) - 1
    first = np.arange(columns)
    last = (rows - 2) * (columns + 1) + first
    faces = np.concatenate([
        np.stack([a, b, c], -1), np.stack([a, c, d], -1),
        np.stack([np.full(columns, south), first + 1, first], -1),
        np.stack([last, last + 1, np.full(columns, north)], -1),
    ])
    return points.astype(np.float32), faces.astype(np.uint32), uv.astype(np.float32)


def tetrahedra(centres: Floats, size: float, seed: int) -> tuple[Floats, Indices]:
    """One closed tetrahedron about each centre, turned at random."""
    rng = np.random.default_rng(seed)
    corner = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * size
    turns = np.linalg.qr(rng.normal(size=(len(centres), 3, 3)))[0]
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    points = np.einsum("nij,kj->nki", turns, corner) + np.asarray(centres)[:, None, :]
    sides = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    faces = sides[None] + 4 * np.arange(len(centres))[:, None, None]
    return points.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.uint32)
