"""Mitsuba's own rule for its render tests, and the pixels that a missing file leaves out.

    ztest.py REF.exr VARIANCE.exr SAMPLES CANDIDATE.exr [X0 Y0 X1 Y1]...

Per pixel and channel of XYZ a z-test of the candidate's mean against the reference with its variance per sample, at a level of one
percent after Sidak's correction for the number of pixels; 99.75 percent of them must pass. Rectangles are left out, in pixels.
"""

import math
import sys

import numpy as np
import OpenEXR

XYZ = np.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])


def read(path):
    planes = {}
    with OpenEXR.File(path) as f:
        for name, channel in f.channels().items():
            pixels = np.array(channel.pixels, np.float64)
            if pixels.ndim == 3:
                planes |= {c: pixels[..., i] for i, c in enumerate("RGBA"[: pixels.shape[2]])}
            else:
                planes[name] = pixels
    return np.stack([planes[c] for c in "RGB"], -1) @ XYZ.T


def main(reference, variance, samples, candidate, *left_out):
    if samples == "?":
        # How many samples Mitsuba takes: two millions for the whole picture.
        height, width = read(reference).shape[:2]
        print(2_000_000 // (height * width))
        return True
    mean, var, found = read(reference), np.maximum(read(variance), 1e-4), read(candidate)
    if found.shape != mean.shape or not np.isfinite(found).all():
        print("FAIL another size, or not finite")
        return False
    z = np.abs(found - mean) * np.sqrt(float(samples) / var)
    p = np.vectorize(math.erfc)(z / math.sqrt(2))
    pixels = mean.shape[0] * mean.shape[1]
    good = p > 1 - (1 - 0.01) ** (1 / pixels)
    counted = np.ones(mean.shape[:2], bool)
    for i in range(0, len(left_out), 4):
        x0, y0, x1, y1 = map(int, left_out[i : i + 4])
        counted[y0:y1, x0:x1] = False
    share = good[counted].mean()
    bias = (found - mean)[counted].mean(0) / mean[counted].mean(0)
    verdict = share >= 0.9975
    print("PASS" if verdict else "FAIL", f"{100 * share:.2f}% of pixels, mean differs by", np.round(100 * bias, 2), "%")
    return verdict


sys.exit(0 if main(*sys.argv[1:]) else 1)
