"""Keyword arguments as the words of the command line: one grammar for both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

# Switches that the command line spells on and off.
_ON_OFF = {"light_sampling", "roulette"}
# Their command line names differ from what reads well in Python.
_NAMES = {"aovs": "aov", "stratification": "stratify"}


def words(options: Mapping[str, Any]) -> list[str]:
    """``spp=4, size=(8, 6), aovs=["albedo"], denoise=True`` to ``--spp 4 --size 8x6 --aov albedo --denoise``."""
    out: list[str] = []
    for name, value in options.items():
        if value is None:
            continue
        flag = "--" + _NAMES.get(name, name).replace("_", "-")
        if isinstance(value, Mapping):
            for key, inner in value.items():
                out += [flag, f"{key}={inner}"]
        elif isinstance(value, bool):
            if name in _ON_OFF:
                out += [flag, "on" if value else "off"]
            elif value:
                out.append(flag)
        else:
            text = _text(name, value)
            if text == "" and name in ("aovs", "aov"):
                continue
            # An equals sign keeps a minus from looking like an option.
            out.append(f"{flag}={text}")
    return out


def _text(name: str, value: Any) -> str:
    if name == "size" and not isinstance(value, str):
        width, height = value
        return f"{int(width)}x{int(height)}"
    if name in ("error", "error_pixels", "confidence") and not isinstance(value, str):
        return f"{100.0 * float(value):.12g}%"
    if name == "time" and not isinstance(value, str):
        return f"{float(value):g}s"
    if isinstance(value, (list, tuple)):
        return ",".join(str(v) for v in value)
    return str(value)
