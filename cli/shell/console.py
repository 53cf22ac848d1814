"""The console of every command: names from outside cannot move its cursor, style its text, or end the command."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from queue import SimpleQueue
from typing import Any

from rich.console import Console
from rich.text import Text

from robot_models.incoming import printable


class _Console(Console):
    """Rich's console, deaf to markup and pictures in names, and silent where nobody reads any more."""

    def render_str(self, text: str, **options: Any) -> Text:
        """A text, with whatever could move the cursor spelt out."""
        return super().render_str(printable(text), **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; a reader who has gone (`| head`) or a full disk is no reason to stop the work."""
        try:
            super().print(*objects, **options)
        except OSError:
            self.on_broken_pipe()

    def on_broken_pipe(self) -> None:
        """Say nothing more."""
        self.quiet = True
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.file.fileno())


def make_console(*, stderr: bool = False, **options: Any) -> Console:
    """A console of this project; a line's style is asked for by `style`, a cell's by `Text`."""
    return _Console(
        stderr=stderr, **({"highlight": False, "soft_wrap": True, "emoji": False, "markup": False} | options)
    )


def as_any_terminal_can() -> None:
    """Have the standard streams spell out what their encoding lacks, instead of failing over it."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


class Background:
    """Prints lines from a thread of its own: a terminal that is slow, or stopped, holds nobody up."""

    def __init__(self, screen: Console) -> None:
        self._screen, self._lines = screen, SimpleQueue[str | None]()
        self._thread = threading.Thread(target=self._print, daemon=True)
        self._thread.start()

    def __call__(self, text: str) -> None:
        """Print, sooner or later."""
        self._lines.put(text)

    def close(self, patience_s: float = 1.0) -> None:
        """Wait for what has been said so far, but not for ever."""
        self._lines.put(None)
        self._thread.join(patience_s)

    def _print(self) -> None:
        with contextlib.suppress(ValueError):  # a stream that was closed meanwhile
            while (text := self._lines.get()) is not None:
                self._screen.print(text)
