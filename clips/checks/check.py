"""One question asked of a recording: what was measured, what a person would show, and what follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from clips.errors import ClipError

Verdict = Literal["holds", "doubtful", "refused", "cannot tell"]


@dataclass(frozen=True, kw_only=True)
class Check:
    """The answer to one question, with its number."""

    what: str  # "feet stand while the body travels"
    value: str  # what was measured
    limit: str  # what a person shows
    verdict: Verdict
    where: str = ""  # seconds and points concerned
    cure: str = ""
    option: str = ""  # the reading option that cures it
    suggestion: str = ""

    def __str__(self) -> str:
        place = f" ({self.where})" if self.where else ""
        return f"{self.what}? {self.value}, a person shows {self.limit}{place}"

    def refusal(self, file: str) -> ClipError:
        """The error that a check ends in."""
        found = f"{self.value}" + (f" ({self.where})" if self.where else "")
        return ClipError(
            file, found=found, expected=self.limit, cure=self.cure, option=self.option, suggestion=self.suggestion
        )
