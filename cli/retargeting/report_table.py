"""The report of a reference as a table for the terminal."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from retarget import Report


def report_table(report: Report) -> Table:
    """Every number of the report, the gates marked."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("", "measured", "value", "gate"):
        table.add_column(column, justify="right" if column in ("value", "gate") else "left")
    for m in report.metrics:
        mark = "" if m.limit is None else Text("ok", style="green") if m.passed else Text("FAIL", style="red")
        table.add_row(mark, m.label, f"{m.value:.4g} {m.unit}", "" if m.limit is None else f"{m.limit:.4g}")
    return table
