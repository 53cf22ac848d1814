"""How a performance is told to stop: Enter, Ctrl-C, or any signal that would otherwise end the process at once."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator

_SIGNALS = {
    signal.SIGINT: "stopped by a person",
    signal.SIGTERM: "stopped by SIGTERM",
    signal.SIGHUP: "stopped by SIGHUP: the terminal is gone",
    signal.SIGQUIT: "stopped by SIGQUIT",
}


class Stop:
    """The first that asked for the end; an empty word while nobody does.

    Until a performance has `begun` nothing was commanded, and whoever asks ends the program at once.
    """

    def __init__(self) -> None:
        self.reason, self.begun = "", False

    def ask(self, reason: str) -> None:
        """The first reason stays."""
        self.reason = self.reason or reason

    def hear(self, number: int) -> None:
        """A signal."""
        if not self.begun:
            raise KeyboardInterrupt
        self.ask(_SIGNALS[signal.Signals(number)])

    def __call__(self) -> str:
        """The reason."""
        return self.reason


@contextlib.contextmanager
def stop_key() -> Iterator[Stop]:
    """Asked by Enter and by every signal that ends programs."""
    stop = Stop()

    def wait() -> None:
        if sys.stdin.readline():  # empty at the end of a file: nobody is there
            stop.ask("stopped by a person")

    if sys.stdin is not None and sys.stdin.isatty():
        threading.Thread(target=wait, daemon=True).start()
    before = {number: signal.signal(number, lambda n, _: stop.hear(n)) for number in _SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
