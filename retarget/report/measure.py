"""Every number of a reference against its source; docs/report.md defines each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy import ndarray

from clips import HumanClip, MetricKey, Reference
from clips.edit import new_times, sample
from retarget.dynamics import Dynamics
from retarget.per_frame import hand_errors, hand_goals
from retarget.report.feet import measure_feet, measure_flight
from retarget.report.metric import Metric, Report, find_worst
from retarget.rules import Gates, ReportConfig
from retarget.targets import LIMBS
from robot_models import RobotModel, SelfCollisions, lowest_points, self_collisions
from robot_models.maths import rotation as rot

_RULES = ReportConfig()
_BY_SIZE = ("hand", "forearm", "foot", "upper arm", "shin", "head", "thigh", "torso", "pelvis")


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
    lowest = lowest_points(robot, reference.body_pos_w, reference.body_quat_w)
    overlaps = self_collisions(robot, reference.qpos)
    joints = _joints(reference, robot, gates)
    on_feet, slip_speed = measure_feet(reference, robot, source, gates)
    in_air = measure_flight(lowest.min(axis=1), reference, source, gates)
    body = [
        *_floor(lowest, reference.body_pos_w, reference.fps, robot, gates),
        *_overlap(overlaps, reference.fps, robot, gates),
    ]
    limbs = Metric(
        key=MetricKey.LIMB_DIRECTION_ERROR, value=_limb_error(reference, robot, source), unit="deg",
        meaning="thighs, shins, upper arms, forearms against the source, world frame",
    )  # fmt: skip
    series = {
        "lowest point [m]": lowest.min(axis=1),
        "self-collision [m]": overlaps.depth,
        "joint speed, share of the motor's": (np.abs(reference.joint_vel) / robot.velocity).max(axis=1),
        "slide of touching edges [m/s]": slip_speed,
    }
    physics = [] if dynamics is None else _physics(dynamics)
    if dynamics is not None:
        series["dynamics, 1 is impossible"] = np.minimum(dynamics.score, 4.0)
    bounds = dict(
        zip(series, (-1e-3 * gates.penetration_mm, 1e-3 * gates.self_collision_mm, gates.speed_share), strict=False)
    )
    return Report(
        metrics=(*joints, *body, limbs, *_hands(reference, robot, source), *on_feet, *in_air, *physics),
        series=series,
        bounds=bounds,
    )


def _floor(lowest: ndarray, body_pos_w: ndarray, fps: float, robot: RobotModel, gates: Gates) -> list[Metric]:
    """How deep anything is under the floor; `lowest` (T, B)."""
    depth = np.maximum(-lowest.min(axis=1), 0.0)

    def body(t: int) -> tuple[str, ...]:
        return (robot.segment(robot.body_names[int(lowest[t].argmin())]),)

    t = int(depth.argmax())
    point = body_pos_w[t, int(lowest[t].argmin())]
    where = find_worst(1e3 * depth, gates.penetration_mm, fps, body)

    return [
        Metric(key=MetricKey.PENETRATION, value=1e3 * float(depth.max()), unit="mm",
               meaning="soles and body primitives, all frames", limit=gates.penetration_mm,
               where=replace(where, point_w=(float(point[0]), float(point[1]), float(lowest[t].min())))),
        Metric(key=MetricKey.FRAMES_UNDER_FLOOR, value=100.0 * float((depth > _RULES.under_floor).mean()), unit="%",
               meaning="lowest point more than 2 mm under the floor"),
    ]  # fmt: skip


def _size(segment: str) -> int:
    """Small parts before large ones: a hand is in a thigh, and no thigh in a hand."""
    return _BY_SIZE.index(part) if (part := segment.removeprefix("left ").removeprefix("right ")) in _BY_SIZE else 0


def _overlap(found: SelfCollisions, fps: float, robot: RobotModel, gates: Gates) -> list[Metric]:
    """How deep two bodies are in one another."""

    def pair(t: int) -> tuple[str, ...]:
        return tuple(sorted(map(robot.segment, found.bodies[t] or ()), key=_size))

    where = find_worst(1e3 * found.depth, gates.self_collision_mm, fps, pair)
    point_w = found.point_w[int(found.depth.argmax())].tolist() if where.parts else None
    return [
        Metric(key=MetricKey.SELF_COLLISION, value=1e3 * float(found.depth.max()), unit="mm",
               meaning="overlap of two bodies' primitives", limit=gates.self_collision_mm,
               where=replace(where, point_w=None if point_w is None else tuple(point_w))),
        Metric(key=MetricKey.FRAMES_SELF_COLLIDING, value=100.0 * float((found.depth > _RULES.overlap).mean()),
               unit="%", meaning="an overlap deeper than 5 mm"),
    ]  # fmt: skip


def _physics(dynamics: Dynamics) -> list[Metric]:
    return [
        Metric(key=MetricKey.IMPOSSIBLE_FRAMES, value=100.0 * float((dynamics.score >= 1.0).mean()), unit="%",
               meaning="the floor or the motors cannot give what the motion needs"),
        Metric(key=MetricKey.TORQUE_SHARE, value=float(np.percentile(dynamics.effort_share, 99)), unit="",
               meaning="99th percentile over frames, worst joint of each"),
    ]  # fmt: skip


def _joints(reference: Reference, robot: RobotModel, gates: Gates) -> list[Metric]:
    q, fps = reference.joint_pos, reference.fps
    rate = min(_RULES.rate, fps)
    at_rate = sample(q, new_times(len(q), fps, rate))
    d1, d2, d3 = (_derivative(at_rate, n, rate) for n in (1, 2, 3))
    beyond = np.maximum(np.maximum(robot.lower - q, q - robot.upper), 0.0)

    def gated(key: MetricKey, values: ndarray, limit: float, unit: str, meaning: str) -> Metric:
        def joint(t: int) -> tuple[str, ...]:
            return (robot.joint_names[int(values[t].argmax())],)

        where = find_worst(values.max(axis=1), limit, fps, joint)
        return Metric(key=key, value=float(values.max()), unit=unit, meaning=meaning, limit=limit, where=where)

    return [
        gated(MetricKey.POSITION_BEYOND_LIMITS, beyond, gates.joint_limit_rad, "rad", "worst joint, all frames"),
        gated(MetricKey.SPEED_SHARE, _derivative(q, 1, fps) / robot.velocity, gates.speed_share, "",
              "worst joint, frame to frame"),
        gated(MetricKey.ACCELERATION_SHARE, _derivative(q, 2, fps) / robot.acceleration, gates.acceleration_share, "",
              "worst joint, frame to frame"),
        Metric(key=MetricKey.SPEED_MAX, value=float(d1.max()), unit="rad/s", meaning=f"at {rate:g} Hz"),
        Metric(key=MetricKey.ACCELERATION_P95, value=float(np.percentile(d2, 95)), unit="rad/s2", meaning=f"at {rate:g} Hz"),
        Metric(key=MetricKey.JERK_P95, value=float(np.percentile(d3, 95)), unit="rad/s3", meaning=f"at {rate:g} Hz"),
    ]  # fmt: skip


def _derivative(x: ndarray, order: int, rate: float) -> ndarray:
    """Absolute differences; one zero where the clip is too short for any."""
    return np.abs(np.diff(x, order, axis=0)) * rate**order if len(x) > order else np.zeros((1, x.shape[1]))


def _hands(reference: Reference, robot: RobotModel, source: HumanClip) -> list[Metric]:
    """How far hands are turned from the person's; nothing where the source has no hands or the robot no wrists."""
    goals = hand_goals(source, robot)
    if not goals:
        return []
    off, can = hand_errors(robot, reference.qpos[reference.dance], goals)
    found = [
        Metric(key=MetricKey.HAND_IN_REACH, value=100.0 * float(can.mean()), unit="%",
               meaning="frames and hands that the wrists can turn there from where the forearms are"),
    ]  # fmt: skip
    if can.any():
        found.insert(0, Metric(key=MetricKey.HAND_TURN_ERROR, value=float(np.degrees(off[can].mean())), unit="deg",
                               meaning="hands of robot and source, world frame, in those frames"))  # fmt: skip
    return found


def _limb_error(reference: Reference, robot: RobotModel, source: HumanClip) -> float:
    """Mean angle between limbs of robot and source [deg]."""
    errors = []
    for a, b in LIMBS:
        pos, quat = reference.body_pos_w[reference.dance], reference.body_quat_w[reference.dance]
        robot_limb = np.diff(robot.landmark_pos((a, b), pos, quat), axis=1)[:, 0]
        human_limb = source.point(b.replace("foot", "ankle")) - source.point(a.replace("foot", "ankle"))
        cosine = np.sum(rot.unit(robot_limb) * rot.unit(human_limb), axis=-1)
        errors.append(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return float(np.degrees(np.mean(errors)))
