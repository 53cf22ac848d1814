"""A page beside a training: the latest policy beside its reference, where it falls, and how it goes."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.shell import make_console
from cli.viewing.serve import announce
from retarget.stage import Figure, Lane, Page, Row, Show, close_server, open_server
from robot_models import RobotModel, forward_kinematics

if TYPE_CHECKING:
    from collections.abc import Callable

    from tracking import Evaluation, Run
    from tracking.task import NamedReference

_CURVES = {"finished": ("finished [%]", 100.0, "green"), "stood": ("stood [%]", 100.0, "steelblue")}
_ERROR = ("body_error_mm", "bodies off [mm]", "darkorange")


@contextmanager
def training_page(
    robot: RobotModel, pieces: Sequence[NamedReference], host: str = "127.0.0.1", port: int = 8080
) -> Iterator[Callable[[Run], None]]:
    """A page for as long as the block lasts; yields what is told of every judgement of the run.

    Args:
        robot: who learns.
        pieces: what it learns.
        host: address to listen at.
        port: the first to try.
    """
    server, over = open_server(host, port), threading.Event()
    announce(make_console(), host, server.get_port())
    curves: dict[str, list[float]] = {"minutes": []}
    page = Page(server, _nothing_yet(robot, pieces[0]), lambda gui: _plot(gui, curves))
    player = threading.Thread(target=page.play, kwargs={"until": over.is_set}, daemon=True)
    player.start()

    def judged(run: Run) -> None:
        piece = min(pieces, key=lambda p: run.evaluations[p.name].finished)
        curves.clear()
        curves.update({key: [row[key] for row in run.curves] for key in ("minutes", "finished", "stood", _ERROR[0])})
        page.change(show_of_run(run, robot, piece))

    try:
        yield judged
    finally:
        over.set()
        player.join(timeout=2.0)
        close_server(server)


def show_of_run(run: Run, robot: RobotModel, piece: NamedReference) -> Show:
    """The best of the last judgement and one that failed, each beside the reference, and the seconds in which robots fail."""
    result, fps = run.evaluations[piece.name], piece.reference.fps
    shown = [(how, qpos) for how, qpos in result.shown.items() if not how.startswith("median")]
    figures = [_figure(how, robot, qpos, place) for place, (how, qpos) in enumerate(shown)]
    hard = result.hardest
    return Show(
        title=f"{piece.name} on {robot.name}, learning",
        verdict=f"{run.steps / 1e6:.2f} M steps, {run.seconds / 60.0:.1f} min: {100 * result.finished:.0f} % finish",
        passed=True,
        fps=fps,
        figures=(*figures, *_meant(robot, piece, len(figures))),
        lanes=(_failures(result, fps),),
        moments=((hard.at_s, f"hardest: {hard.failed} of {result.rollouts} fail here"),) if hard.failed else (),
        rows=_rows(result),
    )


def _nothing_yet(robot: RobotModel, piece: NamedReference) -> Show:
    """The reference, twice: places for the best and the worst."""
    return Show(
        title=f"{piece.name} on {robot.name}, learning", verdict="not judged yet",
        fps=piece.reference.fps, figures=_meant(robot, piece, 2),
    )  # fmt: skip


def _meant(robot: RobotModel, piece: NamedReference, places: int) -> tuple[Figure, ...]:
    """The dance as it is meant to be, pale, at every place."""
    reference, dance = piece.reference, piece.reference.dance
    pos, quat = reference.body_pos_w[dance], reference.body_quat_w[dance]
    return tuple(
        Figure(name="as it is meant", robot=robot, ghost=True, place=k, body_pos_w=pos, body_quat_w=quat)
        for k in range(places)
    )


def _figure(name: str, robot: RobotModel, qpos: np.ndarray, place: int) -> Figure:
    pos, quat = forward_kinematics(robot, qpos)
    return Figure(name=name, robot=robot, place=place, body_pos_w=pos, body_quat_w=quat)


def _failures(result: Evaluation, fps: float) -> Lane:
    """Seconds of the dance, the redder the more robots fail in them."""
    stretches = []
    for second in result.seconds:
        share = second.failed / result.rollouts
        if share > 0.0:
            pale = round(225 * (1.0 - min(1.0, 4.0 * share)))
            a = round(second.at_s * fps)
            stretches.append((a, a + round(fps), (230, pale, pale)))
    return Lane(name="robots fail", stretches=tuple(stretches))


def _rows(result: Evaluation) -> tuple[Row, ...]:
    told = {
        "within the rules": f"{result.survived_s:.1f} of {result.duration_s:.1f} s",
        "stood": f"{100 * result.stood:.0f} %",
        "bodies off": f"{result.body_error_mm:.0f} mm",
        **{name.replace("_", " "): str(count) for name, count in result.causes.items() if count},
    }
    return tuple(Row(passed=None, what=what, value=value, limit="") for what, value in told.items())


def _plot(gui: Any, curves: dict[str, list[float]]) -> None:
    """How it goes over the minutes; nothing before the second judgement."""
    if len(curves["minutes"]) < 2:
        gui.add_markdown("*curves after the second judgement*")
        return
    from viser import uplot

    minutes = np.array(curves["minutes"])
    shares = [scale * np.array(curves[key]) for key, (_, scale, _) in _CURVES.items()]
    series = [uplot.Series(label=label, stroke=colour, width=2) for label, _, colour in _CURVES.values()]
    over = uplot.Series(label="minutes")
    scales = {"x": uplot.Scale(time=False)}
    gui.add_uplot((minutes, *shares), (over, *series), title="over the minutes", scales=scales, height=160)
    key, label, colour = _ERROR
    line = uplot.Series(label=label, stroke=colour, width=2)
    gui.add_uplot((minutes, np.array(curves[key])), (over, line), title=label, scales=scales, height=140)
