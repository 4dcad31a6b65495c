"""One render by Cycles: FOLDER PATTERN SPP SEED WIDTHxHEIGHT THREADS OUT.pfm."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

from ..files import write_pfm


def main() -> None:
    """Opens, renders, writes."""
    folder, pattern, spp, seed, size, threads, out = sys.argv[1:]
    bpy.ops.wm.open_mainfile(filepath=str(Path(folder) / "scene.blend"))
    scene = bpy.context.scene
    scene.render.threads_mode = "FIXED"
    scene.render.threads = int(threads)
    scene.cycles.samples = int(spp)
    scene.cycles.seed = int(seed)
    scene.cycles.sampling_pattern = pattern
    width, height = map(int, size.split("x"))
    scene.render.resolution_x, scene.render.resolution_y = width, height
    file = Path(out).with_suffix(".exr")
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(file))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    write_pfm(Path(out), pixels.reshape(height, width, 4)[::-1, :, :3])


main()
