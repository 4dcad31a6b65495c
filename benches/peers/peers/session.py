"""One session: scenes prepared, competitors run one after the other in rounds, everything written down as it comes."""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from collections import defaultdict
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from . import estimators as e
from .files import read_pfm
from .measure import Cost, Failed, run
from .model import Floats
from .variants import THREADS, Variant

TARGETS = (1e-2, 1e-3)
# Beyond these a peer shows another picture, and is not compared in that scene.
RATIO_TOLERANCE, BLOCK_TOLERANCE = 0.02, 0.04
REFERENCE_FACTOR = 1


@dataclass(frozen=True)
class Plan:
    """What to do. `rounds` is the number of seeds, at least two; `shrink` divides width and height, for a smoke run."""

    scenes: list[str]
    variants: list[Variant]
    start_scenes: list[str]
    rounds: int
    shrink: int
    work: Path


class Session:
    """Collects `record`, which becomes raw.json."""

    def __init__(self, plan: Plan, machine: dict[str, Any]) -> None:
        self.plan = plan
        self.began = time.monotonic()
        self.record: dict[str, Any] = {
            "date": time.strftime("%Y-%m-%d", time.gmtime()), "machine": machine, "threads": THREADS, "rounds": plan.rounds,
            "shrink": plan.shrink, "tolerance": {"ratio": RATIO_TOLERANCE, "blocks": BLOCK_TOLERANCE},
            "variants": {v.key: {k: w for k, w in asdict(v).items() if k != "key"} for v in plan.variants},
            "scenes": {}, "runs": [], "starts": [], "figures": {},
        }

    def scene(self, name: str) -> None:
        """Everything about one scene."""
        folder = self._prepare(name)
        facts = json.loads((folder / "facts.json").read_text())
        width, height = (extent // self.plan.shrink for extent in facts["size"])
        facts["size"] = [width, height]
        self.record["scenes"][name] = facts
        broken: dict[str, str] = {}
        for number in range(self.plan.rounds):
            for spp in facts["spp"]:
                # Competitors one after the other, so that what else the machine does befalls all alike.
                for variant in self.plan.variants:
                    if variant.key in broken:
                        continue
                    try:
                        self._render(variant, name, folder, variant.count(spp), number + 1, (width, height))
                    except Failed as failed:
                        broken[variant.key] = str(failed)
                        self._say(f"{name}: {variant.label} failed: {failed}")
        self._references(folder, facts, (width, height))
        self.figures(name, broken)

    def figures(self, name: str, broken: dict[str, str]) -> None:
        """From the pictures, which stay in the work folder, and the runs on record."""
        folder, facts = self.plan.work / name, self.record["scenes"][name]
        pictures: dict[str, dict[int, list[Floats]]] = defaultdict(lambda: defaultdict(list))
        for run_ in self.record["runs"]:
            if run_["scene"] == name and run_["variant"] not in broken:
                pictures[run_["variant"]][run_["spp"]].append(read_pfm(_picture(folder, run_["variant"], run_["spp"], run_["seed"])))
        # What errors are relative to: the median over the competitors of their best pictures. None of them can bend it, and a pixel that
        # one of them has missed so far, or a spark, does not count.
        scale = np.median([np.mean(by_count[max(by_count)], axis=0) for by_count in pictures.values()], axis=0).astype(np.float32)
        figures = self.record["figures"][name] = {}
        for variant in self.plan.variants:
            if variant.key in broken:
                figures[variant.key] = {"failed": broken[variant.key]}
                continue
            color = variant.color if _half(folder, variant.color, facts["size"][0], 0).exists() else "rgb"
            halves = (read_pfm(_half(folder, color, facts["size"][0], 0)), read_pfm(_half(folder, color, facts["size"][0], 1)))
            figures[variant.key] = self._figures(variant, name, facts, pictures[variant.key], halves, scale)

    def starts(self, name: str) -> None:
        """From nothing to the first small picture: one sample per pixel, wall time, everything loaded. Warm files; Mitsuba with and
        without its cache of compiled kernels."""
        folder = self._prepare(name)
        facts = json.loads((folder / "facts.json").read_text())
        size = (64, max(1, 64 * facts["size"][1] // facts["size"][0]))
        seen = set()
        for number in range(self.plan.rounds + 1):
            for variant in self.plan.variants:
                if variant.key.endswith("-best"):
                    continue
                caches = ["warm", "cold"] if variant.mode.startswith("llvm") else ["-"]
                for cache in caches:
                    home = {"HOME": str(self._fresh_home())} if cache == "cold" else {}
                    out = self.plan.work / "start.pfm"
                    try:
                        cost = run(variant.command(folder, 1, number, size, out), home)
                    except Failed as failed:
                        self._say(f"start {name}: {variant.label} failed: {failed}")
                        continue
                    # The first round only warms the disk's and the kernels' caches.
                    if (variant.key, cache) in seen or cache == "cold":
                        self.record["starts"].append({"scene": name, "variant": variant.key, "kernels": cache, **asdict(cost)})
                    seen.add((variant.key, cache))
        self._say(f"{name}: starts measured")

    def _fresh_home(self) -> Path:
        home = self.plan.work / "home"
        shutil.rmtree(home, ignore_errors=True)
        home.mkdir(parents=True)
        return home

    def _prepare(self, name: str) -> Path:
        """The scene's files, made once for each state of this package."""
        folder = self.plan.work / name
        for child, product in (("write_scene", "facts.json"), ("cycles_write", "scene.blend")):
            if child == "cycles_write" and not any(v.renderer == "cycles" for v in self.plan.variants):
                continue
            if not (folder / product).exists():
                folder.mkdir(parents=True, exist_ok=True)
                run([sys.executable, "-m", f"peers.children.{child}", name, str(folder)])
        return folder

    def _render(self, variant: Variant, name: str, folder: Path, spp: int, seed: int, size: tuple[int, int]) -> None:
        out = _picture(folder, variant.key, spp, seed)
        out.parent.mkdir(exist_ok=True)
        out.unlink(missing_ok=True)
        command = variant.command(folder, spp, seed, size, out)
        cost = run(command)
        self.record["runs"].append({"scene": name, "variant": variant.key, "spp": spp, "seed": seed, **asdict(cost),
                                    "load": round(os.getloadavg()[0], 2), "command": self._portable(command)})
        self._say(f"{name:12} {variant.key:20} {spp:4} spp seed {seed}: {cost.cpu:7.2f} s cpu {cost.wall:7.2f} s wall {cost.peak_mb:7.0f} MB")

    def _references(self, folder: Path, facts: dict[str, Any], size: tuple[int, int]) -> None:
        """Two long pictures by Steradian for each way of colour. Kept with the scene: a later build is held to an earlier one's."""
        for variant in self.plan.variants:
            for seed in (0, 1) if variant.renderer == "steradian" else ():
                out = _half(folder, variant.color, size[0], seed)
                if not out.exists():
                    partial = out.with_suffix(".part.pfm")
                    run(replace(variant, options=()).command(folder, REFERENCE_FACTOR * facts["spp"][-1], 1_000_003 + seed, size, partial))
                    partial.rename(out)

    def _figures(self, variant: Variant, name: str, facts: dict[str, Any], pictures: dict[int, list[Floats]],
                 halves: tuple[Floats, Floats], reference: Floats) -> dict[str, Any]:
        counts = sorted(pictures)
        error = [e.relative_mse(pictures[spp], reference) for spp in counts]
        costs = {spp: [Cost(r["cpu"], r["wall"], r["peak_mb"]) for r in self.record["runs"]
                       if (r["scene"], r["variant"], r["spp"]) == (name, variant.key, spp)] for spp in counts}
        # Round by round: what is common to both numbers of samples, starting and compiling, drops out.
        per_spp = sorted((b.cpu - a.cpu) / (counts[-1] - counts[0]) for a, b in zip(costs[counts[0]], costs[counts[-1]]))
        seconds = per_spp[len(per_spp) // 2] if len(per_spp) % 2 else sum(per_spp[len(per_spp) // 2 - 1 : len(per_spp) // 2 + 1]) / 2
        pixels = facts["size"][0] * facts["size"][1]
        same = e.agreement(pictures[counts[-1]], halves)
        slope = e.slope(counts, error)
        even = self.record["figures"][name].get(variant.evenly)
        if even:
            # Adaptive sampling gains while it learns; beyond what was measured it is taken to gain no more.
            slope = max(slope, even["slope"])
        reached = {str(target): e.spp_to_reach(target, counts, error, slope if even else None) for target in TARGETS}
        return {
            "spp": counts, "relmse": error, "trimmed": [e.trimmed_relative_mse(pictures[spp], reference) for spp in counts],
            "slope": slope, "cpu_per_spp": seconds, "paths_per_cpu_second": pixels / seconds if seconds > 0 else None,
            "cpu_to": {target: spp * seconds for target, spp in reached.items()},
            "how": {target: "inside" if counts[0] <= spp <= counts[-1] else "extrapolated" for target, spp in reached.items()},
            "peak_mb": max(cost.peak_mb for cost in costs[counts[-1]]),
            "ratio": same.ratio, "blocks": same.blocks, "seed_correlation": e.seed_correlation(pictures[counts[-1]], halves),
            "agrees": abs(same.ratio - 1) <= RATIO_TOLERANCE and same.blocks <= BLOCK_TOLERANCE,
        }

    def _portable(self, command: list[str]) -> str:
        """The command line without places of this machine."""
        words = []
        for word in command:
            for place, name in ((str(self.plan.work), "WORK"), (sys.executable, "python")):
                word = word.replace(place, name)
            words.append(Path(word).name if word.startswith("/") else word)
        return " ".join(words)

    def _say(self, text: str) -> None:
        minutes, seconds = divmod(int(time.monotonic() - self.began), 60)
        print(f"{minutes:3}:{seconds:02}  {text}", flush=True)


def _picture(folder: Path, key: str, spp: int, seed: int) -> Path:
    return folder / "pictures" / f"{key}-{spp}-{seed}.pfm"


def _half(folder: Path, color: str, width: int, half: int) -> Path:
    return folder / f"reference-{color}-{width}-{half}.pfm"
