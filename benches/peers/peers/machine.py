"""What machine this is, in words that say nothing about whose it is."""

from __future__ import annotations

import os
import platform
import re
import subprocess
from importlib import metadata
from pathlib import Path


def describe(steradian: str) -> dict[str, object]:
    """Processor, cores, memory, kernel and the versions of all that is measured."""
    info = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    model = re.search(r"model name\s*: (.*)", info)
    flags = set((re.search(r"flags\s*: (.*)", info) or re.match("()", "")).group(1).split())
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "processor": model.group(1) if model else platform.processor(),
        "vector": [name for name in ("sse4_2", "avx2", "avx512f") if name in flags],
        "cores": os.cpu_count(),
        "memory_gib": round(memory, 1),
        "kernel": platform.release(),
        "load_before": [round(x, 2) for x in os.getloadavg()],
        "versions": {
            "steradian": _first_line([steradian, "--version"]) + _commit(),
            "python": platform.python_version(),
            "mitsuba": metadata.version("mitsuba"),
            "drjit": metadata.version("drjit"),
            "bpy": metadata.version("bpy"),
            "llvm": Path(os.environ.get("DRJIT_LIBLLVM_PATH", "default")).name,
        },
    }


def _commit() -> str:
    here = _first_line(["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"])
    return f" ({here})" if here else ""


def _first_line(command: list[str]) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return (done.stdout.splitlines() or [""])[0].strip()
