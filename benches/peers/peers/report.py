"""From raw.json to tables. Needs Python and nothing else, so that anybody can check that a table is what was measured."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any, Iterable

BEGIN, END = "<!-- peers:begin -->", "<!-- peers:end -->"
OURS, OURS_SPECTRAL = "steradian-rgb", "steradian-spectral"
Raw = dict[str, Any]


def write(folder: Path) -> None:
    """table.md and table.csv beside raw.json."""
    raw = load(folder)
    (folder / "table.md").write_text(table(raw))
    (folder / "table.csv").write_text(flat(raw))


def load(folder: Path) -> Raw:
    """What was measured, with the rays against Embree and the growth, where they were measured too."""
    raw: Raw = json.loads((folder / "raw.json").read_text())
    for name in ("rays", "growth"):
        file = folder / f"{name}.json"
        raw[name] = json.loads(file.read_text()) if file.exists() else None
    return raw


def table(raw: Raw) -> str:
    """Everything, for people."""
    lines = [f"# {_when(raw)}", "", _machine(raw), "", "## Ratios", "", *summary(raw), "", *_notes(raw), ""]
    for scene, facts in raw["scenes"].items():
        width, height = facts["size"]
        lines += [f"## {scene}: {facts['sentence']} ({facts['triangles']:,} triangles, {width} x {height}, depth {facts['depth']})", "",
                  "| | M paths / CPU s | relMSE at spp | without the worst 0.1 % | slope | CPU s to 1e-2 | to 1e-3 | × Steradian's to 1e-2 | to 1e-3 "
                  "| peak MB | mean / ours | blocks |",
                  "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
        for key, figure in raw["figures"][scene].items():
            lines.append(_row(raw, scene, key, figure))
        lines.append("")
    lines += ["## Start to first pixel", "", "Wall seconds, one sample per pixel at 64 pixels across, everything loaded.", "",
              "| | " + " | ".join(dict.fromkeys(s["scene"] for s in raw["starts"])) + " |"]
    scenes = list(dict.fromkeys(s["scene"] for s in raw["starts"]))
    lines.append("| --- |" + " ---: |" * len(scenes))
    for key, kernels in dict.fromkeys((s["variant"], s["kernels"]) for s in raw["starts"]):
        label = raw["variants"][key]["label"] + (f", kernels {kernels}" if kernels != "-" else "")
        cells = [_median([s["wall"] for s in raw["starts"] if (s["scene"], s["variant"], s["kernels"]) == (name, key, kernels)]) for name in scenes]
        lines.append(f"| {label} | " + " | ".join("–" if c is None else f"{c:.2f}" for c in cells) + " |")
    if raw["rays"]:
        lines += ["", "## Rays", "", "Millions a second, one thread; `cargo run --release -p benches --bin rays`.", "",
                  "| mesh | | primary | diffuse | shadow | built in s | bytes a triangle |", "| --- | --- | ---: | ---: | ---: | ---: | ---: |"]
        lines += [f"| {r['scene']} | {r['engine']} | {r['primary']:.2f} | {r['diffuse']:.2f} | {r['shadow']:.2f} | {r['build_seconds']:.3f} "
                  f"| {r['bytes_per_triangle']:.0f} |" for r in raw["rays"]]
    if raw["growth"]:
        lines += ["", "## Growth of Steradian", "", "`cargo run --release -p benches --bin growth`; plots: growth-triangles.svg, growth-lights.svg. "
                  "The slope is that of the line in log-log from the first to the last figure.", "",
                  "| with | | figures | slope |", "| --- | --- | --- | ---: |"]
        for (grows_with, case, unit), points in curves(raw["growth"]).items():
            figures = ", ".join(f"{x:,.0f}: {y:.4g}" for x, y in points)
            lines.append(f"| {grows_with} | {case}, {unit} | {figures} | {_slope(points):.2f} |")
    return "\n".join(lines) + "\n"


def curves(growth: list[dict[str, Any]]) -> dict[tuple[str, str, str], list[tuple[float, float]]]:
    """The points of each case."""
    found: dict[tuple[str, str, str], list[tuple[float, float]]] = {}
    for r in growth:
        found.setdefault((r["grows_with"], r["case"], r["unit"]), []).append((r["x"], r["y"]))
    return found


def _slope(points: list[tuple[float, float]]) -> float:
    (x0, y0), (x1, y1) = points[0], points[-1]
    return math.log(y1 / y0) / math.log(x1 / x0) if x1 > x0 else math.nan


def summary(raw: Raw, brief: bool = False) -> list[str]:
    """The figures of merit as a table: geometric mean over the scenes, and the worst scene. Above 1, Steradian is ahead."""
    rows = ["| Steradian against | scenes | geometric mean | worst scene |", "| --- | ---: | ---: | --- |"]
    rgb = [key for key in raw["variants"] if _is(raw, key, "rgb") and not key.startswith("steradian")]
    spectral = [key for key in raw["variants"] if _is(raw, key, "spectral") and not key.startswith("steradian")]

    def line(title: str, ratios: dict[str, float]) -> None:
        if ratios:
            worst = min(ratios, key=lambda name: ratios[name])
            rows.append(f"| {title} | {len(ratios)} | {_bold(_geometric(ratios.values()))} | {_bold(ratios[worst])} {worst} |")
        else:
            rows.append(f"| {title} | 0 | not measured | |")

    for target in ("0.01", "0.001"):
        words = {"0.01": "1e-2", "0.001": "1e-3"}[target]
        line(f"CPU time to relMSE {words}: the best of all others, in each scene", _against(raw, OURS, rgb, lambda f: f["cpu_to"][target]))
        line(f"CPU time to relMSE {words}: the best of all others, Steradian too in its best way",
             _against(raw, [k for k in raw["variants"] if k.startswith(OURS)], rgb, lambda f: f["cpu_to"][target]))
        for name, keys in _renderers(raw, rgb) if target == "0.001" or not brief else []:
            line(f"CPU time to relMSE {words}: {name}, its better sampler", _against(raw, OURS, keys, lambda f: f["cpu_to"][target]))
    for key in rgb:
        if not key.endswith("-best") and not (brief and "llvm" not in key):
            line(f"camera paths per CPU second: {raw['variants'][key]['label']}",
                 _against(raw, OURS, [key], lambda f: 1 / f["paths_per_cpu_second"]))
    for key in spectral:
        line(f"spectral, camera paths per CPU second: {raw['variants'][key]['label']}",
             _against(raw, OURS_SPECTRAL, [key], lambda f: 1 / f["paths_per_cpu_second"]))
        line(f"spectral, CPU time to relMSE 1e-3: {raw['variants'][key]['label']}",
             _against(raw, OURS_SPECTRAL, [key], lambda f: f["cpu_to"]["0.001"]))
    line("start to first pixel: the best of all others, kernels compiled before", _starts(raw, rgb))
    line("peak memory: the best of all others", _against(raw, OURS, rgb, lambda f: f["peak_mb"]))
    if "pbrt" not in raw["variants"]:
        rows.append("| pbrt-v4 | 0 | not measured | |")
    for engine, words in (("robust", "watertight as ours is"), ("fast", "not watertight")):
        line(f"rays per second, one thread: Embree 4, high-quality build, {words}", _rays(raw, f"Embree high {engine}"))
    return rows


def readme(raw: Raw, folder: str) -> str:
    """What stands between the markers of the README."""
    lines = [f"Ratios of one session; above 1 Steradian is ahead, and **losses** stand out. {_machine(raw)}", "", *summary(raw, brief=True), "",
             "| CPU seconds to relMSE 1e-3 | " + " | ".join(raw["scenes"]) + " |", "| --- |" + " ---: |" * len(raw["scenes"])]
    for key in raw["variants"]:
        cells = [_time(raw["figures"][scene].get(key), "0.001") for scene in raw["scenes"]]
        lines.append(f"| {raw['variants'][key]['label']} | " + " | ".join(cells) + " |")
    lines += ["", f"Each run, what agrees with what, and plots: [{folder}]({folder}/table.md). `benches/peers/run` measures all of it again."]
    return "\n".join(lines)


def into_readme(readme_file: Path, results: Path, root: Path) -> bool:
    """Puts the table between the markers; whether that changed anything."""
    text = readme_file.read_text()
    before, rest = text.split(BEGIN, 1)
    _, after = rest.split(END, 1)
    made = f"{before}{BEGIN}\n\n{readme(load(results), results.resolve().relative_to(root.resolve()).as_posix())}\n\n{END}{after}"
    if made != text:
        readme_file.write_text(made)
    return made != text


def stale(root: Path) -> list[str]:
    """Which tables under `root` are not what their raw.json gives."""
    wrong = []
    text = (root / "README.md").read_text()
    for raw_file in sorted((root / "benches/results").glob("*/raw.json")):
        folder = raw_file.parent
        raw = load(folder)
        for name, made in (("table.md", table(raw)), ("table.csv", flat(raw))):
            if (folder / name).read_text() != made:
                wrong.append((folder / name).relative_to(root).as_posix())
        where = folder.relative_to(root).as_posix()
        if f"({where}/table.md)" in text and readme(raw, where) not in text:
            wrong.append("README.md")
    if BEGIN in text and "/table.md)" not in text:
        wrong.append("README.md names no results")
    return wrong


def flat(raw: Raw) -> str:
    """One line for each scene and competitor, for programs."""
    out = io.StringIO()
    names = ["scene", "variant", "paths_per_cpu_second", "cpu_per_spp", "spp", "relmse", "trimmed", "slope", "cpu_to_1e-2", "cpu_to_1e-3",
             "peak_mb", "ratio", "blocks", "agrees", "seed_correlation"]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    for scene, figures in raw["figures"].items():
        for key, f in figures.items():
            if "failed" not in f:
                writer.writerow([scene, key, f["paths_per_cpu_second"], f["cpu_per_spp"], f["spp"][-1], f["relmse"][-1], f["trimmed"][-1], f["slope"],
                                 f["cpu_to"]["0.01"], f["cpu_to"]["0.001"], f["peak_mb"], f["ratio"], f["blocks"], f["agrees"], f["seed_correlation"]])
    return out.getvalue()


def _row(raw: Raw, scene: str, key: str, f: dict[str, Any]) -> str:
    label = raw["variants"][key]["label"]
    if "failed" in f:
        return f"| {label} | failed: {f['failed'].splitlines()[-1] if f['failed'] else 'without a word'} |" + " |" * 10
    base = raw["figures"][scene].get(OURS_SPECTRAL if _is(raw, key, "spectral") else OURS)
    times = []
    for target in ("0.01", "0.001"):
        times.append(f"{f['cpu_to'][target]:.3g}{'' if f['how'][target] == 'inside' else ' *'}")
    if f["agrees"] and base and "failed" not in base:
        ratios = [f"{f['cpu_to'][t] / base['cpu_to'][t]:.2f}" for t in ("0.01", "0.001")]
    else:
        ratios = ["not compared"] * 2
    paths = f["paths_per_cpu_second"]
    return (f"| {label} | {paths / 1e6:.3f} | {f['relmse'][-1]:.3g} at {f['spp'][-1]} | {f['trimmed'][-1]:.3g} | {f['slope']:.2f} | {times[0]} | {times[1]} "
            f"| {ratios[0]} | {ratios[1]} | {f['peak_mb']:.0f} | {f['ratio']:.4f} | {100 * f['blocks']:.2f} % |")


def _against(raw: Raw, ours: str | list[str], peers: Iterable[str], cost: Any) -> dict[str, float]:
    """In each scene, the least cost of the peers that agree over the least of ours."""
    ratios = {}
    for scene, figures in raw["figures"].items():
        def least(keys: Iterable[str]) -> float | None:
            return min((cost(figures[key]) for key in keys if key in figures and figures[key].get("agrees")), default=None)

        mine, theirs = least([ours] if isinstance(ours, str) else ours), least(peers)
        if mine is not None and theirs is not None:
            ratios[scene] = theirs / mine
    return ratios


def _starts(raw: Raw, peers: list[str]) -> dict[str, float]:
    ratios = {}
    for scene in dict.fromkeys(s["scene"] for s in raw["starts"]):
        def wall(key: str) -> float | None:
            return _median([s["wall"] for s in raw["starts"] if s["scene"] == scene and s["variant"] == key and s["kernels"] != "cold"])

        others = [w for w in map(wall, peers) if w is not None]
        mine = wall(OURS)
        if mine and others:
            ratios[scene] = min(others) / mine
    return ratios


def _rays(raw: Raw, engine: str) -> dict[str, float]:
    """By mesh and kind of ray; the build of `benches`, bin `rays`."""
    ratios = {}
    rows = raw["rays"] or []
    for mesh in dict.fromkeys(row["scene"] for row in rows):
        ours = [row for row in rows if row["scene"] == mesh and row["engine"].startswith("Steradian")]
        theirs = [row for row in rows if row["scene"] == mesh and row["engine"] == engine]
        for kind in ("primary", "diffuse", "shadow") if ours and theirs else ():
            ratios[f"{mesh}, {kind}"] = ours[0][kind] / theirs[0][kind]
    return ratios


def _renderers(raw: Raw, keys: list[str]) -> list[tuple[str, list[str]]]:
    """The peers' variants by what a user would choose between: renderer and way of computing."""
    groups: dict[str, list[str]] = {}
    for key in keys:
        variant = raw["variants"][key]
        name = {"mitsuba": f"Mitsuba {variant['mode']}", "cycles": "Cycles"}.get(variant["renderer"], variant["renderer"])
        groups.setdefault(name, []).append(key)
    return list(groups.items())


def _notes(raw: Raw) -> list[str]:
    tolerance = raw["tolerance"]
    return [
        "CPU seconds are of all threads together and without start-up: differences of two numbers of samples, medians over "
        f"{raw['rounds']} rounds in which the competitors run one after the other. relMSE is the variance between seeds over the square "
        "of the median of all competitors' pictures, so no renderer gains by resembling a reference; times to a target follow the line through the two measured numbers of samples "
        "in log-log, those with * beyond them. Resident memory under 10 MB reads as 10.",
        "",
        f"A peer agrees when its mean is within {100 * tolerance['ratio']:.0f} % of Steradian's and its blocks of 16 x 16 pixels within "
        f"{100 * tolerance['blocks']:.0f} % (root mean square, noise removed). Known differences: Mitsuba's rough metals shadow and mask "
        "independently, the others' by height; Cycles interpolates 8-bit textures before it decodes them; spectral renderers turn the same "
        "RGB into different spectra. Spectral pictures are compared with Steradian's spectral ones.",
    ]


def _when(raw: Raw) -> str:
    return f"Steradian and others, {raw['date']}"


def _machine(raw: Raw) -> str:
    m = raw["machine"]
    versions = m["versions"]
    return (f"{m['processor']}, {m['cores']} cores ({', '.join(m['vector'])}), {m['memory_gib']:.0f} GiB, Linux {m['kernel']}, {raw['threads']} threads, "
            f"{raw['date']}: {versions['steradian']}, Mitsuba {versions['mitsuba']}, Cycles of bpy {versions['bpy']}.")


def _is(raw: Raw, key: str, color: str) -> bool:
    return raw["variants"][key]["color"] == color


def _time(figure: dict[str, Any] | None, target: str) -> str:
    if not figure or "failed" in figure:
        return "–"
    return f"{figure['cpu_to'][target]:.3g}" if figure["agrees"] else "differs"


def _bold(value: float) -> str:
    """Losses stand out."""
    return f"{value:.2f}" if value >= 1 else f"**{value:.2f}**"


def _geometric(values: Iterable[float]) -> float:
    logs = [math.log(value) for value in values]
    return math.exp(sum(logs) / len(logs))


def _median(values: list[float]) -> float | None:
    if not values:
        return None
    ordered = sorted(values)
    middle = len(ordered) // 2
    return ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])
