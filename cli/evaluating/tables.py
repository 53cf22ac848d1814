"""What evaluations came to, as tables for the terminal and for recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from tracking import Evaluation


def brief(r: Evaluation) -> Text:
    """Finished, survived, error: one cell of a table."""
    text = f"{100 * r.finished:.0f}, {r.survived_s:.1f}, {r.body_error_mm:.0f}"
    return Text(text, style="" if r.finished >= 0.9 else "red")


def side_by_side(tables: Mapping[str, list[tuple[str, str, str]]]) -> list[tuple[str, ...]]:
    """Header and lines: one column per engine, and the remarks where there is but one."""
    if len(tables) == 1:
        (name, rows), *_ = tables.items()
        return [("", name, ""), *rows]
    columns = list(tables.values())
    return [("", *tables), *((rows[0][0], *(value for _, value, _ in rows)) for rows in zip(*columns, strict=True))]


def rows_of(r: Evaluation) -> list[tuple[str, str, str]]:
    """What is measured, its value, a remark."""
    hard, span = r.hardest, f"[{100 * r.finished_low:.0f}, {100 * r.finished_high:.0f}] % at 95 %"
    failed = f"{hard.failed} failed" if hard.failed else "none failed"
    return [
        ("finished", f"{100 * r.finished:.0f} % of {r.rollouts}", span),
        ("and never 0.5 m off", f"{100 * r.finished_in_place:.0f} %", "in the room"),
        ("survived", f"{r.survived_s:.2f} s", f"of {r.duration_s:.2f} s, within the rules"),
        ("did not fall", f"{100 * r.stood:.0f} %", f"{r.stood_s:.2f} s to the fall; the others strayed"),
        ("body error", f"{r.body_error_mm:.0f} mm", f"+-{r.body_error_half_mm:.1f} at 95 %, root-relative"),
        ("error in the room", f"{r.global_error_mm:.0f} mm", ""),
        ("joint error", f"{r.joint_error_rad:.3f} rad", "mean over joints"),
        ("failures", ", ".join(f"{k} {v}" for k, v in r.causes.items() if v) or "none", ""),
        (
            "hardest",
            f"second {hard.at_s:.0f}: {failed}",
            f"body error {hard.body_error_mm or 0.0:.0f} mm there",
        ),
        *((name.replace("_", " "), f"{value:+.3f}", "of the reward, mean") for name, value in r.terms.items()),
    ]


def grid(columns: Sequence[str], rows: Mapping[str, Sequence[str | Text]]) -> Table:
    """A table of brief cells: a name, then a cell per column."""
    table = Table(box=None, pad_edge=False, header_style="bold", title="finished %, survived s, body error mm")
    for column in ("", *columns):
        table.add_column(column, justify="left" if not column else "right")
    for name, cells in rows.items():
        table.add_row(name, *cells)
    return table
