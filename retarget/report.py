"""What was measured on a reference: numbers with units, gates with pass or fail.

The labels of touching feet come from the source by a fixed rule, never from the tool's own contacts, so that a
retargeter cannot pass by calling nothing a contact. docs/report.md defines every number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import HumanClip, MetricKey, Reference, heights_and_speeds, own_floor
from clips.edit import new_times, sample
from retarget.config import Gates, ReportConfig
from retarget.dynamics import Dynamics
from retarget.targets import LIMBS, foot_yaw_rate, heel_toe_points
from robot_models import RobotModel, heel_toe_positions, lowest_point, self_collision_depth
from robot_models.maths import intervals_of
from robot_models.maths import rotation as rot

_RULES = ReportConfig()


@dataclass(frozen=True, kw_only=True)
class Metric:
    """One measured number; `limit` is its gate, None where it is only told."""

    key: MetricKey
    value: float
    unit: str
    meaning: str
    limit: float | None = None

    @property
    def label(self) -> str:
        """What it is, in words."""
        return self.key.label

    @property
    def passed(self) -> bool:
        """Whether the gate holds; a number without a gate cannot fail."""
        return self.limit is None or self.value <= self.limit

    def worse_than(self, other: Metric) -> bool:
        """Whether it is the worse of two values of one metric."""
        return self.value < other.value if self.key.higher_is_better else self.value > other.value


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """All measured numbers, and the curves behind them for the recording."""

    metrics: tuple[Metric, ...]
    series: Mapping[str, Float[ndarray, "T ..."]]

    def __getitem__(self, key: MetricKey) -> Metric:
        """The metric of a key.

        Raises:
            KeyError: it was not measured, as physics without Pinocchio.
        """
        return {m.key: m for m in self.metrics}[key]

    @property
    def passed(self) -> bool:
        """Whether every gate holds."""
        return all(m.passed for m in self.metrics)

    @property
    def failures(self) -> tuple[Metric, ...]:
        """The gates that do not hold."""
        return tuple(m for m in self.metrics if not m.passed)

    def as_dict(self) -> dict[str, object]:
        """Numbers for the reference's meta entry."""
        return {
            str(m.key): {"value": round(m.value, 6), "unit": m.unit, "limit": m.limit, "passed": m.passed}
            for m in self.metrics
        }


def measure(
    reference: Reference, robot: RobotModel, source: HumanClip, gates: Gates, dynamics: Dynamics | None = None
) -> Report:
    """Measure a reference against its source.

    Args:
        reference: what the robot shall do.
        robot: the robot.
        source: the recorded figure at the reference's frame rate; its frames are the reference's dance.
        gates: what has to hold.
        dynamics: its rigid-body dynamics, to be reported too.
    """
    lowest = lowest_point(robot, reference.body_pos_w, reference.body_quat_w)
    overlap = self_collision_depth(robot, reference.qpos)
    joints = _joints(reference, robot, gates)
    feet, feet_series = _feet(reference, robot, source, gates)
    flight = _flight(lowest, reference.dance, source, gates)
    body = [
        Metric(key=MetricKey.PENETRATION, value=1e3 * max(0.0, -float(lowest.min())), unit="mm",
               meaning="soles and body primitives, all frames", limit=gates.penetration_mm),
        Metric(key=MetricKey.FRAMES_UNDER_FLOOR, value=100.0 * float((lowest < -_RULES.under_floor).mean()), unit="%",
               meaning="lowest point more than 2 mm under the floor"),
        Metric(key=MetricKey.SELF_COLLISION, value=1e3 * float(overlap.max()), unit="mm",
               meaning="overlap of two bodies' primitives", limit=gates.self_collision_mm),
        Metric(key=MetricKey.FRAMES_SELF_COLLIDING, value=100.0 * float((overlap > _RULES.overlap).mean()), unit="%",
               meaning="an overlap deeper than 5 mm"),
        Metric(key=MetricKey.LIMB_DIRECTION_ERROR, value=_limb_error(reference, robot, source), unit="deg",
               meaning="thighs, shins, upper arms, forearms against the source, world frame"),
    ]  # fmt: skip
    series = {
        "lowest point [m]": lowest,
        "self-collision [m]": overlap,
        "joint speed, share of the motor's": (np.abs(reference.joint_vel) / robot.velocity).max(axis=1),
        **feet_series,
    }
    physics = [] if dynamics is None else _physics(dynamics)
    if dynamics is not None:
        series["dynamics, 1 is impossible"] = np.minimum(dynamics.score, 4.0)
    return Report(metrics=(*joints, *body, *feet, *flight, *physics), series=series)


def _physics(dynamics: Dynamics) -> list[Metric]:
    return [
        Metric(key=MetricKey.IMPOSSIBLE_FRAMES, value=100.0 * float((dynamics.score >= 1.0).mean()), unit="%",
               meaning="the floor or the motors cannot give what the motion needs"),
        Metric(key=MetricKey.TORQUE_SHARE, value=float(np.percentile(dynamics.effort_share, 99)), unit="",
               meaning="99th percentile over frames, worst joint of each"),
    ]  # fmt: skip


def _joints(reference: Reference, robot: RobotModel, gates: Gates) -> list[Metric]:
    q = reference.joint_pos
    beyond = float(np.maximum(robot.lower - q, q - robot.upper).max())
    speed = _Share(reference, robot.velocity, 1)
    acceleration = _Share(reference, robot.acceleration, 2)
    at_rate = sample(q, new_times(len(q), reference.fps, min(_RULES.rate, reference.fps)))
    rate = min(_RULES.rate, reference.fps)
    d1, d2, d3 = (_derivative(at_rate, n, rate) for n in (1, 2, 3))
    return [
        Metric(key=MetricKey.POSITION_BEYOND_LIMITS, value=max(0.0, beyond), unit="rad", meaning="worst joint, all frames",
               limit=gates.joint_limit_rad),
        Metric(key=MetricKey.SPEED_SHARE, value=speed.most, unit="", meaning=speed.where(robot),
               limit=gates.speed_share),
        Metric(key=MetricKey.ACCELERATION_SHARE, value=acceleration.most, unit="",
               meaning=acceleration.where(robot), limit=gates.acceleration_share),
        Metric(key=MetricKey.SPEED_MAX, value=float(d1.max()), unit="rad/s", meaning=f"at {rate:g} Hz"),
        Metric(key=MetricKey.ACCELERATION_P95, value=float(np.percentile(d2, 95)), unit="rad/s2", meaning=f"at {rate:g} Hz"),
        Metric(key=MetricKey.JERK_P95, value=float(np.percentile(d3, 95)), unit="rad/s3", meaning=f"at {rate:g} Hz"),
    ]  # fmt: skip


class _Share:
    """A time difference of the joints as a share of the motors' limits, frame to frame."""

    def __init__(self, reference: Reference, limit: Float[ndarray, "J"], order: int) -> None:
        self._fps = reference.fps
        self._share = _derivative(reference.joint_pos, order, reference.fps) / limit
        self.most = float(self._share.max())

    def where(self, robot: RobotModel) -> str:
        """The worst place, and how many frames are beyond."""
        t, j = np.unravel_index(int(self._share.argmax()), self._share.shape)
        beyond = int((self._share > 1.0 + _RULES.rounding).any(axis=1).sum())
        return f"worst at {t / self._fps:.2f} s: {robot.joint_names[j]}" + f"; {beyond} frames beyond" * (beyond > 0)


def _derivative(x: ndarray, order: int, rate: float) -> ndarray:
    """Absolute differences; one zero where the clip is too short for any."""
    return np.abs(np.diff(x, order, axis=0)) * rate**order if len(x) > order else np.zeros((1, x.shape[1]))


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


def _feet(
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


def _flight(lowest: ndarray, dance: slice, source: HumanClip, gates: Gates) -> list[Metric]:
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


def _limb_error(reference: Reference, robot: RobotModel, source: HumanClip) -> float:
    """Mean angle between limbs of robot and source [deg]."""
    errors = []
    for a, b in LIMBS:
        robot_limb = (
            reference.body_pos_w[reference.dance, robot.landmark(b)]
            - reference.body_pos_w[reference.dance, robot.landmark(a)]
        )
        human_limb = source.point(b.replace("foot", "ankle")) - source.point(a.replace("foot", "ankle"))
        cosine = np.sum(rot.unit(robot_limb) * rot.unit(human_limb), axis=-1)
        errors.append(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return float(np.degrees(np.mean(errors)))
