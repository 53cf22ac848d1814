"""Every number of a reference against its source; docs/report.md defines each."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import HumanClip, MetricKey, Reference
from clips.edit import new_times, sample
from retarget.config import Gates, ReportConfig
from retarget.dynamics import Dynamics
from retarget.report.feet import feet, flight
from retarget.report.metric import Metric, Report
from retarget.targets import LIMBS
from robot_models import RobotModel, lowest_point, self_collision_depth
from robot_models.maths import rotation as rot

_RULES = ReportConfig()


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
    on_feet, feet_series = feet(reference, robot, source, gates)
    in_air = flight(lowest, reference.dance, source, gates)
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
    return Report(metrics=(*joints, *body, *on_feet, *in_air, *physics), series=series)


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
