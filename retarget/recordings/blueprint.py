"""What is seen of a recording when it is opened, without a click."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from retarget.recordings.scene import Log


def line_view(name: str, origin: str) -> Callable[[Any], Any]:
    """A plot view, made when the blueprint is."""

    def make(rrb: Any) -> Any:
        # A single curve is named by its view; a legend would only cover it.
        legend = rrb.PlotLegend(visible=name.startswith("slide"))
        return rrb.TimeSeriesView(name=name, origin=f"/{origin}", plot_legend=legend)

    return make


def bar_view(name: str, origin: str) -> Callable[[Any], Any]:
    """A bar chart, made when the blueprint is."""
    return lambda rrb: rrb.BarChartView(name=name, origin=f"/{origin}", plot_legend=rrb.PlotLegend(visible=False))


def send_blueprint(
    log: Log,
    plots: Sequence[Callable[[Any], Any]],
    eye: tuple[float, float, float] = (2.5, -0.7, 1.25),
    look: tuple[float, float, float] = (0.0, 0.5, 0.72),
    tall: int = 0,
) -> None:
    """What is seen when the recording is opened, without a click; the first views may be taller than the rest."""
    import rerun.blueprint as rrb

    view = rrb.Spatial3DView(
        name="dance",
        origin="/world/follow",
        contents=["/world/**"],
        background=rrb.Background(color=(24, 27, 33)),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(kind=rrb.Eye3DKind.Orbital, position=eye, look_target=look, eye_up=(0, 0, 1)),
    )
    side = rrb.Vertical(
        *[p(rrb) for p in plots],
        rrb.TextDocumentView(name="report", origin="/report"),
        row_shares=[*([4] * tall), *([2] * (len(plots) - tall)), max(4, len(plots))],
    )
    log.send_blueprint(
        rrb.Blueprint(
            rrb.Horizontal(view, side, column_shares=[3, 2]) if plots else view,
            rrb.TopPanel(state="hidden"),
            rrb.BlueprintPanel(state="hidden"),
            rrb.SelectionPanel(state="hidden"),
            rrb.TimePanel(state="collapsed", timeline="seconds", play_state="playing", loop_mode="all"),
            auto_views=False,
            auto_layout=False,
        ),
        make_active=True,
        make_default=True,
    )
