"""How a run is told to stop."""

from __future__ import annotations

import signal
import threading


class Signals:
    """Hears SIGINT and SIGTERM, so that a run ends between two iterations with its state saved.

    A second SIGINT interrupts at once; what was saved last is whole then too.
    """

    def __init__(self) -> None:
        self.came = ""

    def __enter__(self) -> Signals:
        if threading.current_thread() is threading.main_thread():  # Python lets no other thread listen
            self._before = {s: signal.signal(s, self._hear) for s in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in getattr(self, "_before", {}).items():
            signal.signal(number, handler)

    def _hear(self, number: int, _: object) -> None:
        if self.came and number == signal.SIGINT:
            raise KeyboardInterrupt
        self.came = f"stopped by {signal.Signals(number).name}; the run can be resumed"
