"""Pictures of finished results, by matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clips import OutputError, write_whole
from robot_models import import_or_refuse

if TYPE_CHECKING:
    from tracking import Cell


def save_sweep(path: Path, rows: Mapping[str, Mapping[str, Cell]], engines: Sequence[str], title: str) -> None:
    """A table of success rates, one row per condition, one column per engine, from red to green.

    Raises:
        OutputError: matplotlib is not installed.
    """
    cure = "pip install 'dance-retarget[sim2sim]'"
    refusal = OutputError("--picture", found="no matplotlib", expected="it installed", cure=cure)
    drawing = import_or_refuse("matplotlib.figure", refusal)
    share = 100.0 * np.array([[row[name].result.finished for name in engines] for row in rows.values()])
    figure = drawing.Figure(figsize=(3.2 + 1.5 * len(engines), 1.0 + 0.34 * len(rows)), layout="constrained", dpi=120)
    axes = figure.add_subplot()
    axes.imshow(share, cmap="RdYlGn", vmin=0.0, vmax=100.0, aspect="auto")
    axes.set_xticks(range(len(engines)), engines)
    axes.set_yticks(range(len(rows)), list(rows))
    axes.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False)
    for (i, j), value in np.ndenumerate(share):
        axes.text(j, i, f"{value:.0f}", ha="center", va="center", color="black")
    axes.set_title(title, fontsize=11)
    with write_whole(path) as stream:
        figure.savefig(stream, format=path.suffix.lstrip(".") or "png")
