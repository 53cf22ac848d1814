"""How far a long computation has come: the one form in which everything here tells it."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class Progress(Protocol):
    """Told how far a stage has come, with a note where there is something to say."""

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        """One step further."""


def silent(stage: str, done: int, total: int, note: str = "") -> None:
    """The `Progress` that nobody hears."""
