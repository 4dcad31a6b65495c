"""One child, one measurement."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

TIMEOUT = 900


@dataclass(frozen=True)
class Cost:
    """Seconds of all threads together, seconds on the wall, and the most memory that was resident."""

    cpu: float
    wall: float
    peak_mb: float


class Failed(Exception):
    """A child that did not end well; the message holds the end of what it said."""


def run(command: list[str], environment: dict[str, str] | None = None) -> Cost:
    """Runs `command` to its end. Raises `Failed` unless it exits with 0."""
    launcher = [sys.executable, "-I", "-S", str(Path(__file__).parent / "children" / "launch.py"), str(TIMEOUT)]
    done = subprocess.run(launcher + command, capture_output=True, text=True, env=os.environ | (environment or {}), check=False)
    said = "\n".join(done.stderr.strip().splitlines()[-8:])
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        raise Failed(said) from None
    if answer["exit"] != 0:
        raise Failed(f"exit {answer['exit']}: {said}")
    return Cost(answer["cpu"], answer["wall"], answer["peak_mb"])
