"""What became of every clip of a batch, as a table for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from cli.shell import make_console
from clips import MetricKey
from retarget.workflows import Outcome

_COLUMNS = (  # of the table on the screen: metric, heading, digits
    (MetricKey.PENETRATION, "floor mm", 1), (MetricKey.SELF_COLLISION, "self mm", 1),
    (MetricKey.LIMB_DIRECTION_ERROR, "limbs deg", 1), (MetricKey.SLIDE_WORST, "slide mm", 1),
    (MetricKey.IMPOSSIBLE_FRAMES, "physics %", 0),
)  # fmt: skip
_STYLE = {"keep": "green", "down-weight": "yellow", "quarantine": "red", "exclude": "red"}


def print_outcomes(console: Console, outcomes: Sequence[Outcome]) -> None:
    """A row per job, then why it is no better."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("verdict", "clip", "robot", "s", *(heading for _, heading, _ in _COLUMNS), ""):
        left = column in ("verdict", "clip", "robot", "")
        table.add_column(column, justify="left" if left else "right", no_wrap=True)
    for o in outcomes:
        numbers = [f"{o.metrics[m]:.{d}f}" if m in o.metrics else "" for m, _, d in _COLUMNS]
        verdict, was_there = Text(o.verdict, style=_STYLE[o.verdict]), "was there" if o.skipped else ""
        table.add_row(verdict, Path(o.clip).name, Path(o.robot).stem, f"{o.seconds:.1f}", *numbers, was_there)
    (console if console.is_terminal else make_console(width=200, soft_wrap=False)).print(table)
    for o in outcomes:
        why = f"below the gate: {', '.join(o.failed)}" if o.failed else o.message
        if o.verdict == "down-weight" and o.hardest:
            why = f"hardest: {o.hardest[0]}"
        if why:
            console.print(f"{o.verdict}: {Path(o.clip).name} on {Path(o.robot).stem}: {why}")
