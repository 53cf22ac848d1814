"""Why a gate does not hold: when, which parts, whose fault, and what would help."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import GLIDING, PLANTED, HumanClip, MetricKey, Reference, heights_and_speeds, own_floor
from retarget.report.metric import Metric, Report, Where
from retarget.rules import DiagnosisConfig, ReportConfig
from retarget.targets import heel_toe_points
from robot_models.maths import intervals_of

Help = Literal["drop", "keep", "slower", "feet carry", "whole clip", "lead in", "state contacts", "other recording"]
_RULES, _CONFIG = ReportConfig(), DiagnosisConfig()
_SEGMENTS = {  # of a person, between two landmarks; and how far its skin is from that line [m]
    "thigh": ("hip", "knee", 0.08), "shin": ("knee", "ankle", 0.06), "foot": ("ankle", "ankle", 0.06),
    "upper arm": ("shoulder", "elbow", 0.05), "forearm": ("elbow", "wrist", 0.04), "hand": ("wrist", "wrist", 0.08),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Cure:
    """Something that helps against a gate that does not hold; seconds are those of the recorded dance."""

    help: Help
    stretches: tuple[tuple[float, float], ...] = ()  # to drop, or the one to keep [s]
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """What became of a gate that does not hold."""

    metric: Metric
    dance: int  # of the reference's dances, that the moment is in
    what: str  # the moment: parts, depth, seconds of the reference
    why: str = ""  # what the recording has to do with it
    cures: tuple[Cure, ...] = ()  # the best first
    at_s: float = 0.0  # the moment in that dance [s]

    def __str__(self) -> str:
        return f"{self.what}; {self.why}" if self.why else self.what


def diagnose(report: Report, reference: Reference, sources: Sequence[HumanClip]) -> tuple[Diagnosis, ...]:
    """A diagnosis of every gate that does not hold, in the report's order.

    Args:
        report: of the reference.
        reference: what was measured.
        sources: what was recorded, at the reference's frame rate; one for each of its dances.
    """
    bad = [stretch for m in report.failures if m.where is not None for stretch in m.where.stretches]
    return tuple(_diagnose(metric, reference, sources, bad) for metric in report.failures)


def _diagnose(
    metric: Metric, reference: Reference, sources: Sequence[HumanClip], bad: Sequence[tuple[float, float]]
) -> Diagnosis:
    """`bad`: the stretches of every gate that is missed [s]."""
    where, key = metric.where or Where(at_s=0.0), metric.key
    k = _dance_of(where, reference, sources)
    dance, source = reference.dances[k], sources[k]
    begins_s, at = dance.start / reference.fps, round(where.at_s * reference.fps) - dance.start
    at = int(np.clip(at, 0, source.frames - 1))
    parting = _parting([(a - begins_s, b - begins_s) for a, b in bad], (source.frames - 1) / reference.fps)
    why, cures = "", list[Cure]()
    if reference.meta.get("as_it_stands"):  # it is its own recording, and explains nothing
        cures = parting
    elif key is MetricKey.SELF_COLLISION:
        why, cures = _of_segments(source, at, where.parts), parting
    elif key is MetricKey.PENETRATION:
        why, cures = _of_height(source, at), parting
    elif key is MetricKey.SLIDE_WORST:
        why, cures = _of_slide(source, at, where, reference.contact[dance]), [Cure(help="state contacts"), *parting]
    elif key in (MetricKey.AIRBORNE_OFF_SOURCE, MetricKey.UNSUPPORTED):
        low, hovering, skating = _feet_of(source)
        why = _of_feet(low, hovering, skating)
        cures = [Cure(help="feet carry")] if skating > max(low, hovering) and key is MetricKey.UNSUPPORTED else []
        cures += [*parting, Cure(help="other recording")]
    elif key is MetricKey.HOVERING_LEADS:
        why, cures = "the dance begins or ends in the air", [Cure(help="lead in")]
    else:
        cures = [Cure(help="whole clip"), Cure(help="slower")]
    if len(sources) > 1 and _outside(round(where.at_s * reference.fps), dance):
        why = "it happens in the steps that join two parts: cut a little earlier or later"
    return Diagnosis(
        metric=metric, dance=k, what=_moment(metric, where), why=why, cures=tuple(cures), at_s=at / reference.fps
    )


def _dance_of(where: Where, reference: Reference, sources: Sequence[HumanClip]) -> int:
    """The dance that a moment is in, or the nearest one."""
    frame = round(where.at_s * reference.fps)
    return min(range(len(sources)), key=lambda i: _outside(frame, reference.dances[i]))


def _outside(frame: int, dance: slice) -> int:
    return max(dance.start - frame, frame - dance.stop + 1, 0)


def _moment(metric: Metric, where: Where) -> str:
    """The worst of a number in words: `left hand in right thigh, 32 mm deep, at 14.10 s`."""
    key, parts = metric.key, where.parts
    at, number = f"at {where.at_s:.2f} s", f"{metric.value:.3g} {metric.unit}".strip()
    more = len(where.stretches) - 1
    others = f", and {more} more time{'s' * (more > 1)}" if more > 0 else ""
    gate = f"allowed: {metric.limit:g}"
    if key is MetricKey.SELF_COLLISION and len(parts) == 2:
        return f"{parts[0]} in {parts[1]}, {number} deep ({gate}), {at}{others}"
    if key is MetricKey.PENETRATION:
        return f"{_first(parts)} {number} under the floor ({gate}), {at}{others}"
    if key is MetricKey.SLIDE_WORST:
        return f"{_first(parts)} slides {number} while it should stand ({gate}), from {where.at_s:.2f} s on{others}"
    if key is MetricKey.AIRBORNE_OFF_SOURCE:
        return f"robot and recording are in the air at different times, {number} apart ({gate}), {_longest(where)}"
    if key is MetricKey.UNSUPPORTED:
        return f"nothing carries the body in {metric.value:.0f} % of the dance ({gate}), {_longest(where)}"
    if key is MetricKey.HOVERING_LEADS:
        return f"{number} of lead-in or lead-out hang in the air ({gate}), {_longest(where)}"
    return f"{_first(parts)}: {metric.label} {number} ({gate}), {at}{others}"


def _first(parts: tuple[str, ...]) -> str:
    return parts[0] if parts else "something"


def _longest(where: Where) -> str:
    a, b = max(where.stretches, key=lambda s: s[1] - s[0], default=(where.at_s, where.at_s))
    return f"longest from {a:.2f} to {b:.2f} s"


def _parting(stretches: Sequence[tuple[float, float]], length_s: float) -> list[Cure]:
    """What to drop, or the one stretch to keep, so that only what holds is left; seconds from the dance's start."""
    bad: list[tuple[float, float]] = []
    for a, b in sorted(stretches):
        if b < 0.0 or a > length_s:  # of another dance, or of the leads
            continue
        a, b = max(0.0, a - _CONFIG.margin_s), min(length_s, b + _CONFIG.margin_s)
        near = bool(bad) and a - bad[-1][1] < _CONFIG.shortest_s
        bad.append((bad[-1][0], max(bad.pop()[1], b)) if near else (a, b))
    edges = [0.0, *(t for stretch in bad for t in stretch), length_s]
    good = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= _CONFIG.shortest_s]
    if not bad or not good:
        return []
    lost = 1.0 - sum(b - a for a, b in good) / length_s
    if lost <= _CONFIG.most_dropped and len(bad) <= _CONFIG.most_drops:
        return [Cure(help="drop", stretches=tuple(bad))]
    return [Cure(help="keep", stretches=(max(good, key=lambda s: s[1] - s[0]),))]


def _of_segments(source: HumanClip, t: int, parts: tuple[str, ...]) -> str:
    """How near the person's own two segments are."""
    lines = [_segment(source, t, part) for part in parts]
    if len(lines) != 2 or lines[0] is None or lines[1] is None:
        return ""
    (a, thick_a), (b, thick_b) = lines[0], lines[1]
    apart = _distance(a, b)
    if apart < thick_a + thick_b:
        return (
            f"the recording's own touch there ({100 * apart:.0f} cm between their middles), and the robot's are thicker"
        )
    return f"the recording's own are {100 * apart:.0f} cm apart there: the robot's proportions bring them together"


def _segment(source: HumanClip, t: int, part: str) -> tuple[ndarray, float] | None:
    """Both ends of a person's segment (2, 3) [m] and how thick it is about the line between [m]."""
    side, _, segment = part.partition(" ")
    if segment in _SEGMENTS:
        a, b, thick = _SEGMENTS[segment]
        return np.stack([source.point(f"{side}_{end}")[t] for end in (a, b)]), thick
    if part in ("pelvis", "torso"):
        low, high = (0.5 * sum(source.point(f"{s}_{end}")[t] for s in ("left", "right")) for end in ("hip", "shoulder"))
        return np.stack((low, low if part == "pelvis" else high)), 0.15
    return None


def _distance(a: Float[ndarray, "2 3"], b: Float[ndarray, "2 3"]) -> float:
    """Between two segments, to a few millimetres [m]."""
    s = np.linspace(0.0, 1.0, 21)[:, None]
    first, second = a[0] + s * (a[1] - a[0]), b[0] + s * (b[1] - b[0])
    return float(np.linalg.norm(first[:, None] - second[None], axis=-1).min())


def _of_height(source: HumanClip, t: int) -> str:
    floor = float(own_floor(heel_toe_points(source)).min())
    height = float(source.point("pelvis")[t, 2]) - floor
    if height < _RULES.upright * source.leg_length:
        return f"the recorded pelvis is {100 * height:.0f} cm over the floor there: floor work"
    return ""


def _of_slide(source: HumanClip, t: int, where: Where, labels: Int[ndarray, "T 4"]) -> str:
    """How far the recording's own edge slides in that touch, or what else it was taken for; `labels` of the dance."""
    points = heel_toe_points(source)
    k = ("left heel", "left toe", "right heel", "right toe").index(where.parts[0])
    height, speed = heights_and_speeds(points, source.fps, own_floor(points))
    standing = _RULES.contact.holds(height, speed)[:, k]
    touch = next(((a, b) for a, b in intervals_of(standing) if a <= t < b), (t, t + 1))
    way = points[slice(*touch), k, :2]
    slid = float(np.linalg.norm(way - way[0], axis=-1).max())
    if slid > _CONFIG.slid_m:
        return f"the recording's own foot slides {1e3 * slid:.0f} mm in that touch"
    if (labels[slice(*touch), k] == GLIDING).mean() > 0.5:
        return "the recording's own foot stands, and the robot's was let glide"
    if (labels[slice(*touch), k] != PLANTED).mean() > 0.5:
        return "the recording's own foot is down and slow for a moment, which was not taken for a touch"
    return "the recording's own foot stands: the robot's leg does not reach"


def _feet_of(source: HumanClip) -> tuple[float, float, float]:
    """Shares of the frames: pelvis low; both feet up for longer than any jump; a foot down, but none that stands."""
    points = heel_toe_points(source)
    floor = own_floor(points)
    height, speed = heights_and_speeds(points, source.fps, floor)
    low = source.point("pelvis")[:, 2] - floor.min() < _RULES.upright * source.leg_length
    up = np.asarray((height > _RULES.contact.height).all(axis=1))
    hovering = np.zeros(len(up), dtype=bool)
    for a, b in intervals_of(up):
        hovering[a:b] = b - a > _RULES.longest_flight_s * source.fps
    skating = ~up & ~_RULES.contact.holds(height, speed).any(axis=1)
    return float(low.mean()), float((hovering & ~low).mean()), float(skating.mean())


def _of_feet(low: float, hovering: float, skating: float) -> str:
    most = max(low, hovering, skating)
    if most < _CONFIG.poor_feet:
        return ""
    if most == low:
        return f"it kneels, sits or lies in {100 * low:.0f} % of the recording: floor work"
    if most == hovering:
        said = f"the recording's own feet hover in {100 * hovering:.0f} % of its frames, longer than any jump"
        return f"{said}, as a video capture's do"
    return f"the recording's own feet slide in {100 * skating:.0f} % of its frames: its travel was lost or made up, or it runs"
