"""The command behind `benches/peers/run`."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
RENDERERS = ["steradian", "mitsuba", "cycles", "pbrt"]
START_SCENES = ["cornell", "mesh-1m", "mesh-8m"]


def main() -> int:
    """0 done, 1 a table is stale, 2 the request makes no sense."""
    parser = argparse.ArgumentParser(prog="benches/peers/run", description="Steradian beside Mitsuba 3, Cycles and pbrt-v4: the same scenes, one session.")
    parser.add_argument("--quick", action="store_true", help="a smoke run of a few minutes: small pictures, two scenes; its figures mean little")
    parser.add_argument("--only", metavar="SCENE,...", help="these scenes")
    parser.add_argument("--peers", metavar="NAME,...", help="these renderers beside Steradian: mitsuba, cycles, pbrt (pbrt needs PBRT=path)")
    parser.add_argument("--rounds", type=int, default=2, help="seeds, each a round of all competitors [2]")
    parser.add_argument("--out", type=Path, help="folder for the results [benches/results/DATE-MACHINE]")
    parser.add_argument("--work", type=Path, default=ROOT / "target" / "peers", help="folder for scenes and pictures [target/peers]")
    parser.add_argument("--readme", action="store_true", help="put the table of --out into the README; with existing results nothing is measured")
    parser.add_argument("--again", action="store_true", help="figures and tables of --out again from the pictures that its run left, measuring nothing")
    parser.add_argument("--self-check", action="store_true", help="check the estimators on data with a known answer, and nothing else")
    parser.add_argument("--check-tables", action="store_true", help="are all committed tables what their raw.json gives? Needs Python only")
    options = parser.parse_args()
    if options.check_tables:
        from . import report

        wrong = report.stale(ROOT)
        print("\n".join(f"stale: {name}" for name in wrong) or "tables: all follow from their raw.json")
        return 1 if wrong else 0
    if options.self_check:
        from . import self_check

        self_check.main()
        return 0
    if options.readme and options.out and (options.out / "raw.json").exists():
        from . import report

        report.write(options.out)
        report.into_readme(ROOT / "README.md", options.out, ROOT)
        return 0
    if options.again:
        again(options.out, options.work)
        return 0
    if options.rounds < 2:
        parser.error("--rounds: two seeds are the least from which an error can be told")
    return measure(options, parser)


def measure(options: argparse.Namespace, parser: argparse.ArgumentParser) -> int:
    """Runs a session and writes its results as they come."""
    from . import machine, plots, report, session, variants
    from .scenes import SCENES

    scenes = options.only.split(",") if options.only else (["cornell", "textured"] if options.quick else list(SCENES))
    peers = ["steradian", *(options.peers.split(",") if options.peers else RENDERERS[1:])]
    for given, known, what in ((scenes, SCENES, "scene"), (peers, RENDERERS, "renderer")):
        for name in given:
            if name not in known:
                parser.error(f"no {what} is called {name}; there are {', '.join(known)}")
    described = machine.describe(os.environ["STERADIAN"])
    out = options.out or ROOT / "benches" / "results" / f"{_today()}-{_words(described)}"
    out.mkdir(parents=True, exist_ok=True)
    work = options.work.resolve() / _state()
    work.mkdir(parents=True, exist_ok=True)
    starts = [name for name in START_SCENES if name in scenes and not (options.quick and options.only is None and name != "cornell")]
    plan = session.Plan(scenes, variants.chosen(peers), starts, options.rounds, 4 if options.quick else 1, work)
    run = session.Session(plan, described)
    os.environ["PYTHONPATH"] = str(Path(__file__).resolve().parents[1])
    for name in scenes:
        run.scene(name)
        if name in starts:
            run.starts(name)
        (out / "raw.json").write_text(json.dumps(run.record, indent=1) + "\n")
        report.write(out)
    rays(out, options.quick)
    growth(out, options.quick)
    report.write(out)
    plots.write(report.load(out), out)
    print("\n".join(report.summary(report.load(out))))
    if options.readme:
        report.into_readme(ROOT / "README.md", out, ROOT)
    print(f"wrote {out}")
    return 0


def again(out: Path, work: Path) -> None:
    """For a change of the estimators after a run."""
    from . import plots, report, session, variants

    record = report.load(out)
    record.pop("rays")
    record.pop("growth")
    present = [v for v in variants.VARIANTS if v.key in record["variants"]]
    run = session.Session(session.Plan(list(record["scenes"]), present, [], record["rounds"], record["shrink"], work.resolve() / _state()), {})
    run.record = record
    for name, figures in list(record["figures"].items()):
        run.figures(name, {key: figure["failed"] for key, figure in figures.items() if "failed" in figure})
    (out / "raw.json").write_text(json.dumps(record, indent=1) + "\n")
    report.write(out)
    plots.write(report.load(out), out)


def rays(out: Path, quick: bool) -> None:
    """Ray queries beside Embree's, where RAYS names that benchmark and the environment has Embree."""
    from . import measure as child

    libraries = sorted(Path(sys.prefix).glob("lib/python*/site-packages/embreex.libs/libembree4*.so*"))
    program = os.environ.get("RAYS")
    if not libraries or not program:
        print("rays: not measured")
        return
    some = ["--only", "20k", "--rounds", "2"] if quick else []
    try:
        child.run([program, "--embree", str(libraries[0]), "--json", str(out / "rays.json"), *some])
    except child.Failed as failed:
        print(f"rays: not measured: {failed}")


def growth(out: Path, quick: bool) -> None:
    """How Steradian grows with triangles, lights, threads and samples, where GROWTH names that benchmark."""
    from . import measure as child

    program = os.environ.get("GROWTH")
    if not program:
        print("growth: not measured")
        return
    some = ["--most", "10000", "--rounds", "1"] if quick else []
    try:
        child.run([program, "--json", str(out / "growth.json"), *some])
    except child.Failed as failed:
        print(f"growth: not measured: {failed}")


def _today() -> str:
    import time

    return time.strftime("%Y-%m-%d", time.gmtime())


def _words(described: dict) -> str:
    name = re.sub(r"\(R\)|\(TM\)|CPU|Processor|@.*", " ", str(described["processor"]))
    return re.sub(r"[^a-z0-9]+", "-", f"{name} {described['cores']} cores".lower()).strip("-")


def _state() -> str:
    """A name for what scenes look like on disk: changes with any file of this package that writes them."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for file in sorted([*here.glob("scenes/*.py"), *here.glob("writers/*.py"), *here.glob("children/*write*.py"),
                        *(here / name for name in ("model.py", "shapes.py", "files.py", "environment.py"))]):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


sys.exit(main())
