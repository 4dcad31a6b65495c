"""What goes wrong, as exceptions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, Optional, Sequence


@dataclass(frozen=True)
class Diagnostic:
    """One problem of a scene: what is wrong, where, and what to do about it."""

    severity: str
    message: str
    file: Optional[str]
    line: Optional[int]
    column: Optional[int]
    hint: Optional[str]
    #: All of that as a person reads it, with the line and a caret.
    text: str

    def __str__(self) -> str:
        return self.text.rstrip()


class SteradianError(Exception):
    """Any error of this package."""


class SceneError(SteradianError, ValueError):
    """A scene has errors. ``diagnostics`` has all of them; ``file``, ``line`` and ``column`` are those of the first."""

    def __init__(self, reports: Sequence[Mapping[str, Any]]) -> None:
        self.diagnostics = [Diagnostic(**report) for report in reports]
        errors = [d for d in self.diagnostics if d.severity == "error"]
        first = errors[0] if errors else None
        self.file = first.file if first else None
        self.line = first.line if first else None
        self.column = first.column if first else None
        self._reports = list(reports)
        super().__init__("\n".join(str(d) for d in errors) or "the scene has errors")

    def __reduce__(self) -> tuple[Any, ...]:
        return (SceneError, (self._reports,))


class InputError(SteradianError, ValueError):
    """What was asked for makes no sense."""


class MachineError(SteradianError, OSError):
    """The machine is at fault: a file that cannot be read, a library that is missing."""
