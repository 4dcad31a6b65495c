"""relMSE against CPU time, one plot for each scene, and all times to 1e-3 in one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams["svg.hashsalt"] = "steradian"

from matplotlib import pyplot as plt  # noqa: E402

from .report import curves  # noqa: E402

COLORS = {"steradian": "#c0392b", "mitsuba": "#2471a3", "cycles": "#d68910", "pbrt": "#1e8449"}
STYLES = {"independent": ":", "": "-", "AUTOMATIC": "-"}


def write(raw: dict[str, Any], folder: Path) -> None:
    """SVG files beside the tables."""
    for scene, figures in raw["figures"].items():
        figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
        for key, f in figures.items():
            if "failed" in f:
                continue
            variant = raw["variants"][key]
            style = "--" if key.endswith("-best") else STYLES.get(variant["sampler"], "-.")
            marker = "s" if variant["color"] == "spectral" else "o"
            note = "" if f["agrees"] else " (differs)"
            axes.loglog([spp * f["cpu_per_spp"] for spp in f["spp"]], f["relmse"], linestyle=style, marker=marker,
                        color=COLORS[variant["renderer"]], label=variant["label"] + note, alpha=0.5 if variant["mode"] == "scalar_rgb" else 1.0)
        axes.set_xlabel("CPU seconds, start-up not counted")
        axes.set_ylabel("relMSE")
        axes.set_title(raw["scenes"][scene]["sentence"])
        axes.grid(True, which="both", alpha=0.25)
        axes.legend(fontsize=7)
        figure.savefig(folder / f"{scene}.svg", metadata={"Date": None})
        plt.close(figure)
    if raw["growth"]:
        growth(raw["growth"], folder)


def growth(rows: list[dict[str, Any]], folder: Path) -> None:
    """Time against triangles and against lights, log-log."""
    for what, unit, label in (("triangles", "ns a ray", "triangles"), ("lights", "ns a path", "emitting triangles")):
        cases = {case: points for (grows_with, case, u), points in curves(rows).items() if (grows_with, u) == (what, unit)}
        if not cases:
            continue
        figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
        for case, points in cases.items():
            axes.loglog(*zip(*points), marker="o", label=case)
        axes.set_xlabel(label)
        axes.set_ylabel(f"{unit}, one thread")
        axes.grid(True, which="both", alpha=0.25)
        axes.legend()
        figure.savefig(folder / f"growth-{what}.svg", metadata={"Date": None})
        plt.close(figure)
