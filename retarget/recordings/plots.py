"""A report's curves as a picture, by matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np

from clips import OutputError
from retarget.report import Report
from robot_models import import_or_refuse


def plot_report(report: Report, fps: float) -> Any:
    """A figure with a panel for each curve: its gate a line, stretches beyond any gate shaded, their worst moments named.

    Args:
        report: with its series by frame.
        fps: of the frames.

    Raises:
        OutputError: matplotlib is not installed.
    """
    cure = "pip install 'dance-retarget[sim2sim]'"
    refusal = OutputError("plot", found="no matplotlib", expected="it installed", cure=cure)
    figures = import_or_refuse("matplotlib.figure", refusal)
    figure = figures.Figure(figsize=(9.0, 1.5 * len(report.series)), layout="constrained", dpi=110)
    panels = np.atleast_1d(figure.subplots(len(report.series), sharex=True))
    for panel, (name, values) in zip(panels, report.series.items(), strict=True):
        panel.plot(np.arange(len(values)) / fps, values, linewidth=1.0)
        panel.set_title(name, fontsize=9, loc="left")
        if name in report.bounds:
            panel.axhline(report.bounds[name], color="red", linewidth=0.8, linestyle=":", label="gate")
        for metric in report.failures:
            for a, b in () if metric.where is None else metric.where.stretches:
                panel.axvspan(a, max(b, a + 1.0 / fps), color="red", alpha=0.15, linewidth=0.0)
    for metric in report.failures:
        if metric.where is not None:
            said = f"{metric.label}, {metric.where.at_s:.2f} s"
            panels[0].axvline(metric.where.at_s, color="red", linewidth=0.8)
            panels[0].annotate(
                said, (metric.where.at_s, 0.9), xycoords=("data", "axes fraction"), fontsize=8, color="red"
            )
    panels[-1].set_xlabel("seconds of the reference")
    return figure
