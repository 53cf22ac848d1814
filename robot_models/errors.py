"""The project's one family of errors: every refusal says where, what was found, what was expected, what to do."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any


class DanceError(Exception):
    """A refusal that the caller can act on.

    Attributes:
        where: file, row, joint ... the place of the fault.
        found: what stands there.
        expected: what should stand there.
        cure: what to do, in words that name no command option (the commands add those).
        option: name of the reading option that would settle the matter, or "".
        suggestion: a value for that option worth trying, or "".
    """

    def __init__(
        self, where: str, *, found: str, expected: str, cure: str = "", option: str = "", suggestion: str = ""
    ) -> None:
        self.where, self.found, self.expected, self.cure = where, found, expected, cure
        self.option, self.suggestion = option, suggestion
        tail = f"; {cure}" if cure else ""
        super().__init__(f"{where}: found {found}, expected {expected}{tail}")


class RobotError(DanceError):
    """A robot's model or profile cannot be used as it stands."""


def import_or_refuse(module: str, refusal: DanceError) -> Any:
    """A module of an optional package; the refusal is raised where it is not installed or does not load."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of one package about another: nobody here can act on it
            return import_module(module)
    except ImportError as e:
        raise refusal from e
