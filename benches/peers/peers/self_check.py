"""The estimators on data of which the answer is known. Seconds; numpy and nothing else."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from . import estimators as e
from .files import read_pfm, write_pfm, write_ply
from .environment import blender, equal_area, latitude_longitude
from .model import Mesh
from .shapes import blob, box, tetrahedra


def main() -> None:
    """Raises AssertionError with the operands where something is wrong."""
    rng = np.random.default_rng(1)
    truth = rng.uniform(0.5, 2.0, (256, 256, 3)).astype(np.float32)

    def noisy(sigma: float, image: np.ndarray = truth) -> np.ndarray:
        return (image * (1 + sigma * rng.normal(size=image.shape))).astype(np.float32)

    # The floor under the denominator lowers the answer by less than 1 %; 200,000 values put the estimate within 1 % (4 sigma).
    for seeds in (2, 3):
        found = e.relative_mse([noisy(0.1) for _ in range(seeds)], truth)
        near(found, 0.01 * np.mean(truth**2 / (truth**2 + (0.05 * truth.mean()) ** 2)), 0.02)
    # A poor reference does not move it: this one is off by as much as the images.
    near(e.relative_mse([noisy(0.1), noisy(0.1)], noisy(0.03)), 0.01, 0.03)
    # A bias common to both seeds is agreement's business, and noise is not.
    fine = e.agreement([noisy(0.5), noisy(0.5)], (noisy(0.5), noisy(0.5)))
    assert abs(fine.ratio - 1) < 0.01 and fine.blocks < 0.01, fine
    biased = truth.copy()
    biased[:, :128] *= 1.1
    off = e.agreement([noisy(0.5, biased), noisy(0.5, biased)], (noisy(0.5), noisy(0.5)))
    near(off.blocks, np.sqrt(0.01 / 2), 0.1)
    near(off.ratio, 1.05, 0.01)
    assert abs(e.seed_correlation([noisy(0.1), noisy(0.1)], (noisy(0.1), noisy(0.1)))) < 0.02
    assert e.seed_correlation([noisy(0.1, biased), noisy(0.1, biased)], (noisy(0.1), noisy(0.1))) > 0.1
    spark = truth.copy()
    spark[7, 9] = 1e4
    assert e.relative_mse([truth, spark], truth) > 100 > 1 > e.trimmed_relative_mse([truth, spark], truth)
    near(e.slope([4, 16, 64], [0.1, 0.1 / 4**1.3, 0.1 / 16**1.3]), -1.3, 1e-9)
    near(e.spp_to_reach(0.01, [4, 16], [0.1, 0.025]), 40.0, 1e-9)
    near(e.spp_to_reach(0.05, [4, 16], [0.1, 0.025]), 8.0, 1e-9)
    near(e.spp_to_reach(0.00625, [4, 16], [0.2, 0.025], -1.0), 64.0, 1e-9)

    for points, faces in (box((1, 2, 3), (0.5, 1, 2), 30), blob((0, 1, 0), 1.0, 5000, 0.1, 3)[:2],
                          tetrahedra(np.zeros((4, 3), np.float32) + np.arange(4)[:, None], 0.1, 1)):
        outwards(points, faces)
    skies()
    with tempfile.TemporaryDirectory() as name:
        write_pfm(Path(name) / "a.pfm", truth[:5, :9])
        assert np.array_equal(read_pfm(Path(name) / "a.pfm"), truth[:5, :9])
        points, faces, uv = blob((0, 0, 0), 1.0, 100, 0.0, 0)
        write_ply(Path(name) / "a.ply", Mesh("a", points, faces, uv=uv))
        head, data = (Path(name) / "a.ply").read_bytes().split(b"end_header\n")
        assert len(data) == 20 * len(points) + 13 * len(faces), head
    print("self-check: the estimators, shapes and files do what they claim")


def outwards(points: np.ndarray, faces: np.ndarray) -> None:
    """A closed mesh whose faces look outwards encloses a positive volume, and its area vectors cancel."""
    a, b, c = (points[faces[:, i]].astype(np.float64) for i in range(3))
    assert np.einsum("ni,ni->", a, np.cross(b, c)) > 0
    total = np.cross(b - a, c - a)
    assert np.abs(total.sum(axis=0)).max() < 1e-4 * np.linalg.norm(total, axis=1).sum()


def skies() -> None:
    """Three projections of one sky hold the same light: for radiance d.x + 2 the mean of the squares over the sphere is 4 + 1/3."""
    def square(d: np.ndarray) -> np.ndarray:
        return np.repeat((d[:, :1] + 2) ** 2, 3, axis=1)

    near(equal_area(square, 256).mean(), 13 / 3, 1e-3)
    weight = np.sin((np.arange(128) + 0.5) / 128 * np.pi)[:, None, None]
    for image in (latitude_longitude(square, 256), blender(square, 256)):
        near((image * weight).sum() / (weight.sum() * 256 * 3), 13 / 3, 1e-3)
    # And each has the same direction where it says: +z, the middle of the square and of Mitsuba's map; +x, the middle of Blender's.
    def up(d: np.ndarray) -> np.ndarray:
        return d

    assert equal_area(up, 65)[32, 32, 2] > 0.999
    assert latitude_longitude(up, 130)[32, 65, 2] > 0.99
    assert blender(up, 130)[32, 65, 0] > 0.99


def near(found: float, expected: float, tolerance: float) -> None:
    """Relative."""
    assert abs(found - expected) <= tolerance * abs(expected), (found, expected, tolerance)
