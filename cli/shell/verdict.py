"""What a command came to: one line, the numbers that matter, what is wrong, what to type next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cli.shell.terminal import BELOW_GATE, DONE


@dataclass(frozen=True, kw_only=True)
class Trouble:
    """One thing that is wrong, and commands that help."""

    what: str
    cures: tuple[tuple[str, str], ...] = ()  # (what to do, the command; or nothing where there is none)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a command came to."""

    passed: bool
    line: str
    code: int | None = None  # exit code; by default 0 or 1 as it passed
    numbers: tuple[str, ...] = ()  # the few that matter
    notes: tuple[str, ...] = ()  # what was recognised, in a line each
    doubts: tuple[str, ...] = ()
    troubles: tuple[Trouble, ...] = ()
    written: tuple[Path, ...] = ()
    steps: tuple[tuple[str, str], ...] = ()  # (command, what it is for)
    data: Mapping[str, Any] = field(default_factory=dict)  # for machines

    @property
    def exit_code(self) -> int:
        """0 done, 1 done below a gate."""
        return self.code if self.code is not None else DONE if self.passed else BELOW_GATE

    def as_dict(self) -> dict[str, Any]:
        """For machines."""
        told = {
            "passed": self.passed, "exit_code": self.exit_code, "verdict": self.line, "numbers": self.numbers,
            "notes": self.notes, "doubts": self.doubts,
            "troubles": [{"what": t.what, "cures": [{"do": d, "command": c} for d, c in t.cures]} for t in self.troubles],
            "written": [str(path) for path in self.written],
            "next": [{"command": c, "why": why} for c, why in self.steps],
        }  # fmt: skip
        return told | dict(self.data)
