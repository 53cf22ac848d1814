"""`Show`: everything that a page can show of a dance, as arrays; nothing here knows how it is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import FREE, GLIDING, PIVOTING, PLANTED, HumanClip, MetricKey, Reference, metric_label
from clips.music import music_of
from retarget.dynamics import Dynamics
from retarget.errors import RetargetError
from retarget.report import Diagnosis, Report
from robot_models import CONTACT_NAMES, PART_NAMES, RobotModel

Colour = tuple[int, int, int]
GREY, GREEN, ORANGE, BLUE, RED = (120, 125, 135), (60, 190, 110), (245, 170, 40), (70, 160, 245), (230, 55, 45)
_BEAT: Colour = (190, 110, 235)
OF_CONTACT: dict[int, Colour] = {FREE: GREY, PLANTED: GREEN, PIVOTING: ORANGE, GLIDING: BLUE}
_ARROW_M, _NOT_GIVEN = 1.2, 0.5  # an arrow as strong as the weight; the score from which what is missing is drawn


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """A robot through time."""

    name: str
    robot: RobotModel
    body_pos_w: Float[ndarray, "T B 3"]  # [m]
    body_quat_w: Float[ndarray, "T B 4"]  # wxyz
    contact: Int[ndarray, "T 4"] | None = None  # of the sole edges
    place: int = 0  # from left to right, where figures stand side by side
    ghost: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Person:
    """Who was recorded, as bones, from a frame of the show on."""

    begins: int
    bones_w: Float[ndarray, "T K 2 3"]  # [m]


@dataclass(frozen=True, kw_only=True, eq=False)
class Arrows:
    """Forces on the first figure, one colour."""

    colour: Colour
    tail_w: Float[ndarray, "T K 3"]  # [m]
    along_w: Float[ndarray, "T K 3"]  # [m]; 0: not drawn


@dataclass(frozen=True, kw_only=True)
class Lane:
    """What something does over time: stretches [frames) and their colours."""

    name: str
    stretches: tuple[tuple[int, int, Colour], ...]


@dataclass(frozen=True, kw_only=True)
class Row:
    """A number of the report, in words."""

    passed: bool | None  # None: only told
    what: str
    value: str
    limit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Show:
    """Figures, the person, forces, and what is to be read beside them; all on one clock."""

    title: str
    verdict: str
    passed: bool = True
    fps: float
    figures: tuple[Figure, ...]
    people: tuple[Person, ...] = ()
    arrows: tuple[Arrows, ...] = ()
    lanes: tuple[Lane, ...] = ()
    moments: tuple[tuple[float, str], ...] = ()  # seconds and what is wrong there
    rows: tuple[Row, ...] = ()

    @property
    def frames(self) -> int:
        """Of the longest figure."""
        return max(len(f.body_pos_w) for f in self.figures)


def show_retargeting(
    robot: RobotModel,
    reference: Reference,
    report: Report,
    diagnoses: Sequence[Diagnosis],
    sources: Sequence[HumanClip] = (),
    dynamics: Dynamics | None = None,
) -> Show:
    """A reference with what is known of it.

    Args:
        robot: the robot.
        reference: what it shall do.
        report: of the reference.
        diagnoses: of the gates that are missed.
        sources: what was recorded, one for each dance of the reference; none where the robot is its own source.
        dynamics: whose forces are drawn.
    """
    return Show(
        title=f"{_file(reference)} on {robot.name}",
        verdict=_verdict(len(report.failures)),
        passed=report.passed,
        fps=reference.fps,
        figures=(figure_of(robot.name, robot, reference),),
        people=tuple(_person(s, d.start) for s, d in zip(sources, reference.dances, strict=False)),
        arrows=() if dynamics is None else _forces(dynamics),
        lanes=(*contact_lanes(reference), *_beat_lane(reference), *_gate_lanes(diagnoses, reference)),
        moments=tuple(sorted((d.metric.where.at_s if d.metric.where else 0.0, str(d)) for d in diagnoses)),
        rows=tuple(_row(m.label, m.value, m.unit, m.limit, m.passed) for m in report.metrics),
    )


def show_reference(robot: RobotModel, reference: Reference, dynamics: Dynamics | None = None) -> Show:
    """A reference with what its own file says of it.

    Args:
        robot: the robot.
        reference: what it shall do, and what was measured when it was made.
        dynamics: whose forces are drawn.
    """
    missed = [(key, m) for key, m in reference.report.items() if not m["passed"]]
    order = list(MetricKey)
    fps, told = reference.fps, sorted(reference.report.items(), key=lambda item: order.index(MetricKey(item[0])))
    return Show(
        title=f"{_file(reference)} on {robot.name}",
        verdict=_verdict(len(missed)) if reference.report else "nothing was measured when it was made",
        passed=not missed,
        fps=fps,
        figures=(figure_of(robot.name, robot, reference),),
        arrows=() if dynamics is None else _forces(dynamics),
        lanes=(*contact_lanes(reference), *_beat_lane(reference)),
        moments=tuple(sorted((float(m.get("at_s", 0.0)), metric_label(key)) for key, m in missed)),
        rows=tuple(_row(metric_label(k), m["value"], m["unit"], m["limit"], m["passed"]) for k, m in told),
    )


def show_side_by_side(motions: Mapping[str, tuple[RobotModel, Reference]]) -> Show:
    """Several references, each in its place, the longest deciding how long it lasts.

    Raises:
        RetargetError: references of different frame rates.
    """
    first = next(iter(motions.values()))[1]
    for name, (_, reference) in motions.items():
        if abs(reference.fps - first.fps) > 1e-6:
            raise RetargetError(
                name, found=f"{reference.fps:g} frames/s", expected=f"{first.fps:g}, as the first has",
                cure="retarget both at one frame rate",
            )  # fmt: skip
    return Show(
        title=" | ".join(motions),
        verdict=f"{len(motions)} motions on one clock",
        fps=first.fps,
        figures=tuple(figure_of(n, robot, r, place=k) for k, (n, (robot, r)) in enumerate(motions.items())),
        lanes=tuple(lane for n, (_, r) in motions.items() for lane in contact_lanes(r, f"{n}: ")),
    )


def figure_of(name: str, robot: RobotModel, reference: Reference, *, place: int = 0) -> Figure:
    """A reference as a figure."""
    return Figure(
        name=name, robot=robot, place=place,
        body_pos_w=reference.body_pos_w, body_quat_w=reference.body_quat_w, contact=reference.contact,
    )  # fmt: skip


def contact_lanes(reference: Reference, prefix: str = "") -> tuple[Lane, ...]:
    """A lane for every sole edge, and for every other part that touches the floor."""
    labels = dict(zip(CONTACT_NAMES, reference.contact.T, strict=True))
    if reference.part_contact is not None:
        labels |= {n: kinds for n, kinds in zip(PART_NAMES, reference.part_contact.T, strict=True) if kinds.any()}
    lanes = []
    for name, kinds in labels.items():
        edges = np.flatnonzero(np.diff(kinds, prepend=-1, append=-1))
        runs = ((int(a), int(b), int(kinds[a])) for a, b in pairwise(edges))
        stretches = tuple((a, b, OF_CONTACT[kind]) for a, b, kind in runs if kind != FREE)
        lanes.append(Lane(name=prefix + name.replace("_", " "), stretches=stretches))
    return tuple(lanes)


def _beat_lane(reference: Reference) -> tuple[Lane, ...]:
    """When the beats are of the song that it was made for."""
    music = music_of(reference)
    if music is None:
        return ()
    frames = np.round(music.beats_s * reference.fps).astype(int)
    return (Lane(name="beats", stretches=tuple((t, t + 1, _BEAT) for t in frames.tolist())),)


def _gate_lanes(diagnoses: Sequence[Diagnosis], reference: Reference) -> tuple[Lane, ...]:
    lanes = []
    for d in diagnoses:
        if d.metric.where is not None:
            spans = d.metric.where.stretches or ((d.metric.where.at_s, d.metric.where.at_s),)
            red = tuple((round(a * reference.fps), round(b * reference.fps) + 1, RED) for a, b in spans)
            lanes.append(Lane(name=d.metric.label, stretches=red))
    return tuple(lanes)


def _person(source: HumanClip, begins: int) -> Person:
    bones = np.array([(p, k) for k, p in enumerate(source.parents) if p >= 0], dtype=int).reshape(-1, 2)
    return Person(begins=begins, bones_w=source.positions[:, bones])


def _forces(dynamics: Dynamics) -> tuple[Arrows, ...]:
    """What the floor gives, from where it acts; in red from the centre of mass what is missing."""
    scale = _ARROW_M / dynamics.weight
    given = scale * dynamics.force_w
    missing = scale * np.where(dynamics.score[:, None] > _NOT_GIVEN, dynamics.residual[:, :3], 0.0)[:, None]
    return (
        Arrows(colour=(120, 200, 255), tail_w=dynamics.point_w, along_w=given),
        Arrows(colour=RED, tail_w=dynamics.com_w[:, None], along_w=missing),
    )


def _file(reference: Reference) -> str:
    return str(reference.meta.get("source", {}).get("file", "")) or "a reference"


def _verdict(missed: int) -> str:
    return "every gate holds" if not missed else f"{missed} gate{'s' * (missed > 1)} missed"


def _row(what: str, value: float, unit: str, limit: float | None, passed: bool) -> Row:
    return Row(
        passed=None if limit is None else passed,
        what=what,
        value=f"{value:.4g} {unit}",
        limit="" if limit is None else f"{limit:.4g}",
    )
