"""One render by Mitsuba: FOLDER VARIANT SAMPLER SPP SEED WIDTHxHEIGHT THREADS OUT.pfm."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi


def main() -> None:
    """Loads, renders, writes."""
    folder, variant, sampler, spp, seed, size, threads, out = sys.argv[1:]
    dr.set_thread_count(int(threads))
    mi.set_variant(variant)
    whole = json.loads((Path(folder) / "mitsuba.json").read_text())
    eye, target, up = whole["sensor"].pop("look_at")
    whole["sensor"]["to_world"] = mi.ScalarTransform4f().look_at(origin=eye, target=target, up=up)
    width, height = map(int, size.split("x"))
    whole["sensor"]["film"] |= {"width": width, "height": height}
    whole["sensor"]["sampler"] = {"type": sampler, "sample_count": int(spp)}
    absolute(whole, Path(folder))
    choose_spectra(whole, "spectral" in variant)
    scene = mi.load_dict(whole)
    image = mi.render(scene, spp=int(spp), seed=int(seed))
    mi.Bitmap(image).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False).write(out)


def absolute(node: dict[str, Any], folder: Path) -> None:
    """File names relative to the scene become whole."""
    for key, value in node.items():
        if isinstance(value, dict):
            absolute(value, folder)
        elif key == "filename":
            node[key] = str(folder / value)


def choose_spectra(node: dict[str, Any], spectral: bool) -> None:
    """Metals come with two versions of k."""
    for value in node.values():
        if isinstance(value, dict):
            choose_spectra(value, spectral)
    curve = node.pop("spectral_k", None)
    if curve and spectral:
        node["k"] = curve


main()
