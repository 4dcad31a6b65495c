"""The sampling toolbox of the lecture over arrays: sequences, samplers, warps, distributions.

A warp comes as three functions: ``square_to_x`` maps points of the unit square (N x 2), ``square_to_x_pdf`` is the density of what comes out,
``x_to_square`` the inverse.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _steradian as _native
from ._steradian import (
    Piecewise1D,
    Piecewise2D,
    cosine_hemisphere_to_square,
    halton,
    sobol,
    square_to_cosine_hemisphere,
    square_to_cosine_hemisphere_pdf,
    square_to_uniform_disk,
    square_to_uniform_disk_pdf,
    square_to_uniform_hemisphere,
    square_to_uniform_hemisphere_pdf,
    square_to_uniform_sphere,
    square_to_uniform_sphere_pdf,
    square_to_uniform_triangle,
    star_discrepancy,
    uniform_disk_to_square,
    uniform_hemisphere_to_square,
    uniform_sphere_to_square,
    uniform_triangle_to_square,
)


def points(
    sampler: str,
    count: int,
    dimensions: int = 2,
    *,
    seed: int = 0,
    randomize: str = "fastowen",
    pixel: tuple[int, int] = (0, 0),
    resolution: tuple[int, int] = (1, 1),
) -> npt.NDArray[np.float32]:
    """What a sampler of the renderer gives one pixel: ``count`` x ``dimensions`` numbers in [0, 1).

    ``sampler`` is independent, stratified, halton, sobol, paddedsobol, zsobol or pmj02bn; ``randomize`` none, permutedigits, fastowen or owen.
    """
    return _native.sampler_points(sampler, count, dimensions, seed, randomize, pixel, resolution)


__all__ = [
    "Piecewise1D",
    "Piecewise2D",
    "cosine_hemisphere_to_square",
    "halton",
    "points",
    "sobol",
    "square_to_cosine_hemisphere",
    "square_to_cosine_hemisphere_pdf",
    "square_to_uniform_disk",
    "square_to_uniform_disk_pdf",
    "square_to_uniform_hemisphere",
    "square_to_uniform_hemisphere_pdf",
    "square_to_uniform_sphere",
    "square_to_uniform_sphere_pdf",
    "square_to_uniform_triangle",
    "star_discrepancy",
    "uniform_disk_to_square",
    "uniform_hemisphere_to_square",
    "uniform_sphere_to_square",
    "uniform_triangle_to_square",
]
