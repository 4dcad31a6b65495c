"""From pictures to figures. Nothing here trusts a reference more than it must."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .model import Floats

BLOCK = 16
# A pixel darker than this share of the picture's mean is measured against that instead.
FLOOR = 0.05


def relative_mse(images: list[Floats], reference: Floats) -> float:
    """The relative mean squared error of one of `images`, which differ in their seed alone.

    The sample variance of each pixel (for two images, half the squared difference) over the squared reference. The reference is only a
    scale, the same for all: no renderer is favoured by being close to it.
    """
    if len(images) < 2:
        raise ValueError("two seeds are needed")
    stack = np.stack([image.astype(np.float64) for image in images])
    return float(np.mean(stack.var(axis=0, ddof=1) / _scale(reference)))


def trimmed_relative_mse(images: list[Floats], reference: Floats, share: float = 0.001) -> float:
    """The same without the worst `share` of the pixels: how much of the error is a few sparks."""
    stack = np.stack([image.astype(np.float64) for image in images])
    error = np.sort((stack.var(axis=0, ddof=1) / _scale(reference)).mean(axis=-1).ravel())
    return float(np.mean(error[: len(error) - int(len(error) * share)]))


def seed_correlation(images: list[Floats], halves: tuple[Floats, Floats]) -> float:
    """Correlation between the errors of two seeds; far from 0, the seeds are not independent or the pictures are biased.

    Each seed is measured against its own half of the reference, whose noise would else be common to both.
    """
    scale = np.sqrt(_scale(0.5 * (halves[0] + halves[1])))
    a, b = ((image - half) / scale for image, half in zip(images, halves))
    return float(np.sum(a * b) / np.sqrt(np.sum(a * a) * np.sum(b * b)))


@dataclass(frozen=True)
class Agreement:
    """How far from a reference the expected picture is: `ratio` of the means, and `blocks`, the root mean square of the relative
    difference of blocks of 16 x 16 pixels, freed from noise."""

    ratio: float
    blocks: float


def agreement(images: list[Floats], halves: tuple[Floats, Floats]) -> Agreement:
    """Products of the errors of two different seeds, each against another half of the reference: four independent pictures, so that all
    noise has mean 0 in them and what is left is the squared bias."""
    ref = _blocks(0.5 * (halves[0] + halves[1]))
    used = ref > FLOOR * ref.mean()
    scale = np.where(used, ref, 1.0)
    one, other = ([((_blocks(image) - _blocks(half)) / scale)[used] for image in images] for half in halves)
    products = [np.mean(one[i] * other[j]) for i in range(len(images)) for j in range(len(images)) if i != j]
    mean = np.mean([image.mean(dtype=np.float64) for image in images])
    return Agreement(float(mean / np.mean(halves, dtype=np.float64)), float(np.sqrt(max(0.0, np.mean(products)))))


def slope(spp: list[float], error: list[float]) -> float:
    """Least squares in log-log: -1 for independent samples."""
    return float(np.polyfit(np.log(spp), np.log(error), 1)[0])


def spp_to_reach(target: float, spp: list[float], error: list[float], gradient: float | None = None) -> float:
    """Samples per pixel at which the fitted line meets `target`, inside or outside of what was measured; with a `gradient`, the line of
    that slope through the last point."""
    if gradient is None:
        gradient, offset = np.polyfit(np.log(spp), np.log(error), 1)
    else:
        offset = np.log(error[-1]) - gradient * np.log(spp[-1])
    return float(np.exp((np.log(target) - offset) / gradient))


def _scale(reference: Floats) -> np.ndarray:
    """The square of each channel of each pixel, with the floor under it."""
    wide = reference.astype(np.float64)
    return wide**2 + (FLOOR * wide.mean()) ** 2


def _blocks(image: Floats) -> np.ndarray:
    height, width = (extent // BLOCK * BLOCK for extent in image.shape[:2])
    return image[:height, :width].astype(np.float64).reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean(axis=(1, 3))
