"""What the feet do: labels of touching edges by a fixed rule, slides, flights, frames that nothing carries.

The labels come from the source alone, never from the tool's own contacts, so that a retargeter cannot pass by calling
nothing a contact.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import HumanClip, MetricKey, Reference, heights_and_speeds, own_floor
from retarget.report.metric import Metric, Where
from retarget.rules import Gates, ReportConfig
from retarget.targets import body_up, foot_yaw_rate, heel_toe_points, soles_down
from robot_models import CONTACT_NAMES, RobotModel, heel_toe_positions
from robot_models.maths import intervals_of

_RULES = ReportConfig()


def contact_labels(source: HumanClip) -> tuple[Bool[ndarray, "T 4"], Bool[ndarray, "T 4"]]:
    """(touching, pivoting) per edge by the fixed rule, from the source alone."""
    points = heel_toe_points(source)
    in_contact = _RULES.contact.holds(*heights_and_speeds(points, source.fps, own_floor(points)))
    in_contact &= np.repeat(soles_down(source), 2, axis=1)
    for k in range(4):
        for a, b in intervals_of(in_contact[:, k]):
            if b - a < _RULES.shortest_contact:
                in_contact[a:b, k] = False
    pivoting = in_contact & np.repeat(np.abs(foot_yaw_rate(source)) > _RULES.pivot_rate, 2, axis=1)
    return in_contact, pivoting


def measure_feet(
    reference: Reference, robot: RobotModel, source: HumanClip, gates: Gates
) -> tuple[list[Metric], Float[ndarray, "T 4"]]:
    """Slides and heights of sole edges while the source's touch, and the edges' speeds over the floor meanwhile [m/s]."""
    in_contact, pivoting = contact_labels(source)
    edges = heel_toe_positions(robot, reference.body_pos_w, reference.body_quat_w)
    first, fps = reference.dance.start, reference.fps
    dance = edges[reference.dance]
    still = in_contact & ~pivoting
    steps = np.linalg.norm(np.diff(dance[..., :2], axis=0), axis=-1) * fps
    inside = still[1:] & still[:-1]
    touches = [(a, b, k) for k in range(4) for a, b in intervals_of(still[:, k])]
    slides = [1e3 * float(np.linalg.norm(dance[a:b, k, :2] - dance[a, k, :2], axis=-1).max()) for a, b, k in touches]
    height = np.abs(dance[..., 2][in_contact])
    speed = np.full((reference.frames, 4), 0.0)
    speed[first + 1 : reference.dance.stop] = np.where(inside, steps, 0.0)
    metrics = [
        Metric(key=MetricKey.CONTACT_SPEED, value=100.0 * float(steps[inside].mean()) if inside.any() else 0.0,
               unit="cm/s", meaning="heel and toe edges while the source's touch and do not pivot"),
        Metric(key=MetricKey.SLIDE_MEAN, value=float(np.mean(slides)) if slides else 0.0, unit="mm",
               meaning="farthest from where the touch began"),
        Metric(key=MetricKey.SLIDE_WORST, value=max(slides, default=0.0), unit="mm", meaning="the same",
               limit=gates.slide_mm, where=_worst_slide(touches, slides, gates.slide_mm, first, dance, fps)),
        Metric(key=MetricKey.CONTACT_HEIGHT, value=1e3 * float(height.mean()) if height.size else 0.0, unit="mm",
               meaning="distance from the floor, pivots too"),
        Metric(key=MetricKey.CONTACT_SHARE, value=100.0 * float(in_contact.mean()), unit="%",
               meaning="of all edges and frames: how much the feet numbers rest on"),
    ]  # fmt: skip
    return metrics, speed


def _worst_slide(
    touches: list[tuple[int, int, int]],
    slides: list[float],
    limit: float,
    first: int,
    edges: Float[ndarray, "T 4 3"],
    fps: float,
) -> Where | None:
    """Of touches (start, end, edge) in frames of the dance, and how far each slid [mm]; `first` is the dance's frame."""
    if not slides:
        return None
    a, _, k = touches[int(np.argmax(slides))]
    beyond = sorted((t[0], t[1] - 1) for t, slide in zip(touches, slides, strict=True) if slide > limit)
    return Where(
        at_s=(first + a) / fps,
        parts=(CONTACT_NAMES[k].replace("_", " "),),
        point_w=tuple(edges[a, k].tolist()),
        stretches=tuple(((first + x) / fps, (first + y) / fps) for x, y in beyond),
    )


def measure_flight(lowest: Float[ndarray, "T"], reference: Reference, source: HumanClip, gates: Gates) -> list[Metric]:
    """Frames in the air, of robot and source, and frames that nothing carries."""
    source_up, dance, fps = _flying(source), reference.dance, reference.fps
    up = lowest > _RULES.airborne_height
    share, source_share = 100.0 * float(up[dance].mean()), 100.0 * float(source_up.mean())
    off, uncarried = np.zeros((2, len(up)), dtype=bool)
    off[dance] = (up[dance] != source_up) & (up[dance] == (share > source_share))
    uncarried[dance] = _uncarried(source, source_up)
    in_leads = np.zeros(len(up), dtype=bool)
    for lead in reference.leads:
        in_leads[lead] = up[lead]
    return [
        Metric(key=MetricKey.AIRBORNE, value=share, unit="%", meaning="lowest point over 2 cm up, dance only"),
        Metric(key=MetricKey.AIRBORNE_SOURCE, value=source_share, unit="%",
               meaning="toes and ankles over 4 cm up, nothing else down"),
        Metric(key=MetricKey.AIRBORNE_OFF_SOURCE, value=abs(share - source_share), unit="points",
               meaning="jumps that were lost or made", limit=gates.airborne_points, where=_longest(off, fps)),
        Metric(key=MetricKey.UNSUPPORTED, value=100.0 * float(uncarried[dance].mean()), unit="%",
               meaning="of the source's frames: upright on feet that slide or hover", limit=gates.unsupported_percent,
               where=_longest(uncarried, fps)),
        Metric(key=MetricKey.HOVERING_LEADS, value=float(in_leads.sum()), unit="frames",
               meaning="lowest point over 2 cm up in lead-in or lead-out", limit=gates.hovering_frames,
               where=_longest(in_leads, fps)),
    ]  # fmt: skip


def _longest(frames: Bool[ndarray, "T"], fps: float) -> Where | None:
    """The stretches that have something, the longest of them the worst."""
    stretches = tuple((a / fps, (b - 1) / fps) for a, b in intervals_of(frames))
    if not stretches:
        return None
    return Where(at_s=max(stretches, key=lambda s: s[1] - s[0])[0], stretches=stretches)


def _flying(source: HumanClip) -> Bool[ndarray, "T"]:
    """Frames in which the feet are over their floor, and the rest of the body is higher than one that lies or kneels."""
    points = heel_toe_points(source)
    floor = own_floor(points)
    height, _ = heights_and_speeds(points, source.fps, floor)
    return np.asarray((height > _RULES.contact.height).all(axis=1) & body_up(source, _RULES.down))


def _uncarried(source: HumanClip, up: Bool[ndarray, "T"]) -> Bool[ndarray, "T"]:
    """Frames of an upright source in which neither a foot stands nor both are in a flight that gravity ends.

    A clip that skates, because its travel was lost or its feet float, cannot teach a robot to stand.
    """
    floor, flying = own_floor(heel_toe_points(source)), up.copy()
    for a, b in intervals_of(up):
        flying[a:b] = b - a <= _RULES.longest_flight_s * source.fps
    upright = np.asarray(source.point("pelvis")[:, 2] - floor.min() > _RULES.upright * source.leg_length)
    carried = contact_labels(source)[0].any(axis=1) | flying
    return np.asarray(upright & ~carried)
