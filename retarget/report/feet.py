"""What the feet do: labels of touching edges by a fixed rule, slides, flights, frames that nothing carries.

The labels come from the source alone, never from the tool's own contacts, so that a retargeter cannot pass by calling
nothing a contact.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool
from numpy import ndarray

from clips import HumanClip, MetricKey, Reference, heights_and_speeds, own_floor
from retarget.config import Gates, ReportConfig
from retarget.report.metric import Metric
from retarget.targets import foot_yaw_rate, heel_toe_points
from robot_models import RobotModel, heel_toe_positions
from robot_models.maths import intervals_of

_RULES = ReportConfig()


def contact_labels(source: HumanClip) -> tuple[Bool[ndarray, "T 4"], Bool[ndarray, "T 4"]]:
    """(touching, pivoting) per edge by the fixed rule, from the source alone."""
    points = heel_toe_points(source)
    in_contact = _RULES.contact.holds(*heights_and_speeds(points, source.fps, own_floor(points)))
    for k in range(4):
        for a, b in intervals_of(in_contact[:, k]):
            if b - a < _RULES.shortest_contact:
                in_contact[a:b, k] = False
    pivoting = in_contact & np.repeat(np.abs(foot_yaw_rate(source)) > _RULES.pivot_rate, 2, axis=1)
    return in_contact, pivoting


def feet(
    reference: Reference, robot: RobotModel, source: HumanClip, gates: Gates
) -> tuple[list[Metric], dict[str, ndarray]]:
    in_contact, pivoting = contact_labels(source)
    edges = heel_toe_positions(robot, reference.body_pos_w, reference.body_quat_w)
    dance = edges[reference.dance]
    still = in_contact & ~pivoting
    steps = np.linalg.norm(np.diff(dance[..., :2], axis=0), axis=-1) * reference.fps
    inside = still[1:] & still[:-1]
    slides = [
        1e3 * float(np.linalg.norm(dance[a:b, k, :2] - dance[a, k, :2], axis=-1).max())
        for k in range(4)
        for a, b in intervals_of(still[:, k])
    ]
    height = np.abs(dance[..., 2][in_contact])
    speed = np.full((reference.frames, 4), 0.0)
    speed[reference.dance.start + 1 : reference.dance.stop] = np.where(inside, steps, 0.0)
    metrics = [
        Metric(key=MetricKey.CONTACT_SPEED, value=100.0 * float(steps[inside].mean()) if inside.any() else 0.0,
               unit="cm/s", meaning="heel and toe edges while the source's touch and do not pivot"),
        Metric(key=MetricKey.SLIDE_MEAN, value=float(np.mean(slides)) if slides else 0.0, unit="mm",
               meaning="farthest from where the touch began"),
        Metric(key=MetricKey.SLIDE_WORST, value=max(slides, default=0.0), unit="mm", meaning="the same",
               limit=gates.slide_mm),
        Metric(key=MetricKey.CONTACT_HEIGHT, value=1e3 * float(height.mean()) if height.size else 0.0, unit="mm",
               meaning="distance from the floor, pivots too"),
        Metric(key=MetricKey.CONTACT_SHARE, value=100.0 * float(in_contact.mean()), unit="%",
               meaning="of all edges and frames: how much the feet numbers rest on"),
    ]  # fmt: skip
    return metrics, {"slide of touching edges [m/s]": speed}


def flight(lowest: ndarray, dance: slice, source: HumanClip, gates: Gates) -> list[Metric]:
    points = heel_toe_points(source)
    height, _ = heights_and_speeds(points, source.fps, own_floor(points))
    source_share = 100.0 * float((height > _RULES.contact.height).all(axis=1).mean())
    up = lowest > _RULES.airborne_height
    share, leads = 100.0 * float(up[dance].mean()), np.delete(up, np.arange(len(up))[dance])
    return [
        Metric(key=MetricKey.AIRBORNE, value=share, unit="%", meaning="lowest point over 2 cm up, dance only"),
        Metric(key=MetricKey.AIRBORNE_SOURCE, value=source_share, unit="%", meaning="toes and ankles over 4 cm up"),
        Metric(key=MetricKey.AIRBORNE_OFF_SOURCE, value=abs(share - source_share), unit="points",
               meaning="jumps that were lost or made", limit=gates.airborne_points),
        Metric(key=MetricKey.UNSUPPORTED, value=_unsupported(source), unit="%",
               meaning="of the source's upright frames: feet that slide or hover", limit=gates.unsupported_percent),
        Metric(key=MetricKey.HOVERING_LEADS, value=float(leads.sum()), unit="frames",
               meaning="lowest point over 2 cm up in lead-in or lead-out", limit=gates.hovering_frames),
    ]  # fmt: skip


def _unsupported(source: HumanClip) -> float:
    """Share of the upright frames in which neither a foot stands nor both are in a flight that gravity ends [%].

    A clip that skates, because its travel was lost or its feet float, cannot teach a robot to stand.
    """
    points = heel_toe_points(source)
    floor = own_floor(points)
    height, _ = heights_and_speeds(points, source.fps, floor)
    flying = np.asarray((height > _RULES.contact.height).all(axis=1))
    for a, b in intervals_of(flying):
        flying[a:b] = b - a <= _RULES.longest_flight_s * source.fps
    upright = source.point("pelvis")[:, 2] - floor.min() > _RULES.upright * source.leg_length
    carried = contact_labels(source)[0].any(axis=1) | flying
    return 100.0 * float((upright & ~carried).sum()) / max(1.0, float(upright.sum()))
