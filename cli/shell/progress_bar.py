"""How far a command has come, told on stderr: a bar with the time to go, or a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich import progress as rich_progress

from cli.shell.console import make_console
from robot_models.maths import Progress

_QUIET_S = 15.0  # between two lines of progress in a log


@contextmanager
def progress(unit: str) -> Iterator[Progress]:
    """A bar per stage on stderr, with the time to go; a line now and then where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield _Lines(unit)
        return
    text = rich_progress.TextColumn
    bar = rich_progress.Progress(
        text("{task.description}"), rich_progress.BarColumn(), rich_progress.MofNCompleteColumn(), text(unit),
        rich_progress.TimeElapsedColumn(), text("eta"), rich_progress.TimeRemainingColumn(), text("{task.fields[note]}"),
        console=make_console(stderr=True, soft_wrap=False),
    )  # fmt: skip
    tasks: dict[str, Any] = {}
    with bar:

        def tell(stage: str, done: int, total: int, note: str = "") -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(f"{stage:<18}", total=total, note=note, completed=done)
            bar.update(tasks[stage], completed=done, total=total, note=note)

        yield tell


class _Lines:
    """Progress for log files: a line every quarter of a minute."""

    def __init__(self, unit: str) -> None:
        self._unit, self._said = unit, time.monotonic()
        self._began: dict[str, tuple[float, int]] = {}  # when, and with how much done: a resumed run begins with some

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        now = time.monotonic()
        began, before = self._began.setdefault(stage, (now, done))
        if done < before or done <= 1:  # a stage that comes again
            began, before = self._began[stage] = now, done
        if now - self._said < _QUIET_S:
            return
        self._said = now
        left = f", {(now - began) / (done - before) * (total - done):.0f} s to go" if done > before else ""
        make_console(stderr=True).print(f"{stage}: {done}/{total} {self._unit}{left}{', ' if note else ''}{note}")
