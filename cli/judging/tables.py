"""Reports of several motions side by side, and how far two are from each other."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from cli.judging.judge import Judged
from clips import MetricKey
from retarget import limb_angles


def metrics_table(judged: Sequence[Judged]) -> Table:
    """A row for each number, a column for each file, the gates marked."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("measured", *(j.name for j in judged), "gate"):
        table.add_column(column, justify="left" if column == "measured" else "right", overflow="fold")
    reports = [{m.key: m for m in j.result.report.metrics} for j in judged]
    keys = [key for key in MetricKey if any(key in report for report in reports)]
    for key in keys:
        metrics = [report.get(key) for report in reports]
        gate = next((m.limit for m in metrics if m is not None and m.limit is not None), None)
        cells = [
            Text("") if m is None else Text(f"{m.value:.4g} {m.unit}", style="" if m.passed else "red") for m in metrics
        ]
        table.add_row(key.label, *cells, "" if gate is None else f"{gate:.4g}")
    return table


def difference_table(first: Judged, second: Judged) -> Table:
    """The angle between each limb of two motions, frame by frame from the first on."""
    table = Table("limb", "mean", "worst", "at", box=None, pad_edge=False, header_style="bold")
    one, two = first.result, second.result
    fps = one.reference.fps
    for limb, angle in limb_angles(one.reference, one.robot, two.reference, two.robot).items():
        t = int(angle.argmax())
        table.add_row(limb, f"{angle.mean():.1f} deg", f"{angle[t]:.1f} deg", f"{t / fps:.2f} s")
    return table
