"""The commands: parse, call one function, report, return an exit code."""

import sys
from types import TracebackType


def _stopped(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """A word for who presses Ctrl-C while a command still imports; everything else as ever."""
    if issubclass(kind, KeyboardInterrupt):
        sys.stderr.write("stopped\n")
    else:
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _stopped  # the first line of every command imports this package

from robot_models import __version__  # noqa: E402

__all__ = ["__version__"]
