"""The stop key of a performance: Enter, or Ctrl-C."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def stop_key() -> Iterator[threading.Event]:
    """Set by Enter and by Ctrl-C."""
    pressed = threading.Event()

    def wait() -> None:
        if sys.stdin.readline():  # empty at the end of a file: nobody is there
            pressed.set()

    if sys.stdin is not None and sys.stdin.isatty():
        threading.Thread(target=wait, daemon=True).start()
    before = signal.signal(signal.SIGINT, lambda *_: pressed.set())
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
