"""Who takes part: each renderer in each of its ways."""

from __future__ import annotations

import math
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

THREADS = 2


@dataclass(frozen=True)
class Variant:
    """One way to run one renderer. `mode` is its own word for how it computes, `sampler` for where its numbers come from."""

    key: str
    renderer: str
    label: str
    color: str
    mode: str
    sampler: str
    # Slow ones take a fraction of the samples,
    share: int = 1
    # and those that first have to learn where to put them a multiple.
    times: int = 1
    options: tuple[str, ...] = ()
    # The variant that does the same without learning.
    evenly: str = ""

    def count(self, spp: int) -> int:
        """The samples per pixel that it takes where others take `spp`: what its sampler would round to anyway."""
        spp = max(1, spp * self.times // self.share)
        if self.sampler == "multijitter":
            columns = math.isqrt(spp)
            return columns * -(-spp // columns)
        return spp

    def command(self, folder: Path, spp: int, seed: int, size: tuple[int, int], out: Path) -> list[str]:
        """The program and its arguments for one render of the scene in `folder`."""
        extent = f"{size[0]}x{size[1]}"
        match self.renderer:
            case "steradian":
                sampler = ["--sampler", self.sampler] if self.sampler else []
                return [os.environ["STERADIAN"], "render", str(folder / "scene.pbrt"), "--color", self.mode, *sampler, *self.options, "--spp", str(spp),
                        "--seed", str(seed), "--size", extent, "--threads", str(THREADS), "--quiet", "-o", str(out)]
            case "mitsuba":
                return [sys.executable, "-m", "peers.children.mitsuba_render", str(folder), self.mode, self.sampler, str(spp), str(seed),
                        extent, str(THREADS), str(out)]
            case "cycles":
                return [sys.executable, "-m", "peers.children.cycles_render", str(folder), self.sampler, str(spp), str(seed), extent,
                        str(THREADS), str(out)]
            case "pbrt":
                return [os.environ["PBRT"], str(_resized(folder, size)), "--spp", str(spp), "--seed", str(seed), "--nthreads", str(THREADS),
                        "--quiet", "--outfile", str(out)]
        raise ValueError(self.renderer)


VARIANTS = [
    Variant("steradian-rgb", "steradian", "Steradian rgb, zsobol (default)", "rgb", "rgb", ""),
    Variant("steradian-rgb-best", "steradian", "Steradian rgb, paddedsobol", "rgb", "rgb", "paddedsobol"),
    Variant("steradian-rgb-adaptive", "steradian", "Steradian rgb, zsobol, --adaptive", "rgb", "rgb", "", times=4, options=("--adaptive",),
            evenly="steradian-rgb"),
    Variant("steradian-spectral", "steradian", "Steradian spectral, zsobol (default)", "spectral", "spectral", ""),
    Variant("mitsuba-scalar", "mitsuba", "Mitsuba scalar_rgb, independent (default)", "rgb", "scalar_rgb", "independent", 4),
    Variant("mitsuba-llvm", "mitsuba", "Mitsuba llvm_ad_rgb, independent (default)", "rgb", "llvm_ad_rgb", "independent"),
    Variant("mitsuba-llvm-best", "mitsuba", "Mitsuba llvm_ad_rgb, multijitter", "rgb", "llvm_ad_rgb", "multijitter"),
    Variant("mitsuba-spectral", "mitsuba", "Mitsuba llvm_ad_spectral, multijitter", "spectral", "llvm_ad_spectral", "multijitter"),
    Variant("cycles", "cycles", "Cycles, automatic (default)", "rgb", "rgb", "AUTOMATIC", 2),
    Variant("cycles-best", "cycles", "Cycles, tabulated Sobol'", "rgb", "rgb", "TABULATED_SOBOL", 2),
    Variant("pbrt", "pbrt", "pbrt-v4, zsobol (default)", "spectral", "spectral", ""),
]


def _resized(folder: Path, size: tuple[int, int]) -> Path:
    """The scene with a picture of this size, for those who have no option for it."""
    file = folder / f"scene-{size[0]}x{size[1]}.pbrt"
    if not file.exists():
        text = (folder / "scene.pbrt").read_text()
        for name, extent in zip(("xresolution", "yresolution"), size):
            text = re.sub(rf'"integer {name}" \d+', f'"integer {name}" {extent}', text, count=1)
        file.write_text(text)
    return file


def chosen(renderers: list[str]) -> list[Variant]:
    """The variants of these renderers, in order; pbrt only where the environment names its binary."""
    return [v for v in VARIANTS if v.renderer in renderers and (v.renderer != "pbrt" or os.environ.get("PBRT"))]
