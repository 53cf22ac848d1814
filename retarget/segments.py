"""Lead-in and lead-out: from standing still into the first pose and back, with the feet where the dance has them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import FREE, PLANTED
from retarget.config import RetargetConfig
from retarget.feet import FootTargets, smoothstep
from robot_models import FEET, RobotModel
from robot_models import rotation as rot

SEGMENT_NAMES = ("lead-in", "dance", "lead-out")


@dataclass(frozen=True, kw_only=True, eq=False)
class Padded:
    """A motion with its leads, before the feet are repaired."""

    qpos: Float[ndarray, "T nq"]
    feet: FootTargets
    segments: Int[ndarray, "S 3"]
    names: tuple[str, ...]


def add_leads(robot: RobotModel, qpos: Float[ndarray, "T nq"], feet: FootTargets, config: RetargetConfig) -> Padded:
    """Put a stand and a blend before and after the dance.

    The stand takes the feet's places from the dance's end pose, set flat on the floor; a foot that is in the air
    there lifts off during the blend.
    """
    head = _lead(robot, qpos[0], _frame(feet, 0), config, config.lead_in_s)
    tail = _lead(robot, qpos[-1], _frame(feet, -1), config, config.lead_out_s)
    parts_q, parts_f = [qpos], [feet]
    names = ["dance"]
    if head is not None:
        parts_q, parts_f, names = [head[0], *parts_q], [head[1], *parts_f], ["lead-in", *names]
    if tail is not None:
        parts_q, parts_f, names = [*parts_q, tail[0][::-1]], [*parts_f, _reverse(tail[1])], [*names, "lead-out"]
    ends = np.cumsum([len(p) for p in parts_q])
    starts = np.concatenate(([0], ends[:-1]))
    return Padded(
        qpos=np.concatenate(parts_q),
        feet=FootTargets(
            pos=np.concatenate([f.pos for f in parts_f]),
            quat=rot.continuous(np.concatenate([f.quat for f in parts_f])),
            contact=np.concatenate([f.contact for f in parts_f]),
            shift=np.concatenate([f.shift for f in parts_f]),
        ),
        segments=np.array([(a, b, int(i > 0)) for i, (a, b) in enumerate(zip(starts, ends, strict=True))]),
        names=tuple(names),
    )


def _lead(
    robot: RobotModel, end: ndarray, feet: FootTargets, config: RetargetConfig, duration_s: float
) -> tuple[ndarray, FootTargets] | None:
    """Frames from the stand up to, but without, the pose `end`."""
    if duration_s <= 0.0:
        return None
    stand, stand_feet = _stand(robot, end, feet)
    still = round(config.stand_s * config.fps)
    # Long enough that the blend's top speed, 15/8 of its mean (minimum jerk), stays under half of every motor's.
    needed = np.abs(end[7:] - stand[7:]) / (0.5 * robot.velocity) * 1.875
    moving = int(np.ceil(max(duration_s, float(needed.max())) * config.fps))
    w = np.concatenate((np.zeros(still), smoothstep(np.arange(moving) / moving)))
    q = stand + w[:, None] * (end - stand)
    q[:, 3:7] = rot.slerp(np.tile(stand[3:7], (len(w), 1)), np.tile(end[3:7], (len(w), 1)), w)
    # The feet take the last three quarters of the time, so that the weight has shifted before one lifts.
    lift = smoothstep((w - 0.25) / 0.75)
    pos = stand_feet.pos + lift[:, None, None] * (feet.pos - stand_feet.pos)
    quat = rot.slerp(
        np.tile(stand_feet.quat, (len(w), 1, 1)), np.tile(feet.quat, (len(w), 1, 1)), np.tile(lift[:, None], (1, 2))
    )
    # An edge stays planted where it is so in the end pose; the others lift with the blend.
    down = feet.contact[0] != FREE
    contact = np.where(down[None] | (lift[:, None] < 1e-3), PLANTED, FREE)
    return q, FootTargets(pos=pos, quat=quat, contact=contact, shift=np.zeros((len(w), 2, 2)))


def _stand(robot: RobotModel, end: ndarray, feet: FootTargets) -> tuple[ndarray, FootTargets]:
    """The default pose over the end pose's feet, both set flat."""
    heading = rot.from_yaw(rot.yaw(feet.quat[0]))
    pos = feet.pos.copy()
    pos[0, :, 2] = [-robot.soles[s].z for s in FEET]
    q = np.array(robot.default_qpos)
    yaw = rot.from_yaw(rot.yaw(end[None, 3:7]))[0]
    q[3:7] = rot.multiply(yaw, q[3:7])
    soles_middle = pos[0].mean(axis=0) + rot.rotate(yaw, _foot_middle(robot))
    q[:2] = soles_middle[:2]
    planted = np.full((1, 4), PLANTED)
    return q, FootTargets(pos=pos, quat=heading[None], contact=planted, shift=np.zeros((1, 2, 2)))


def _foot_middle(robot: RobotModel) -> ndarray:
    """From the middle between the ankles to the pelvis in the default pose, in the pelvis' level frame [m]."""
    from robot_models import forward_kinematics

    pos, _ = forward_kinematics(robot, robot.default_qpos[None])
    return pos[0, 0] - pos[0, [robot.landmark(f"{s}_foot") for s in FEET]].mean(axis=0)


def _frame(feet: FootTargets, t: int) -> FootTargets:
    part = slice(t, None) if t == -1 else slice(t, t + 1)
    return FootTargets(pos=feet.pos[part], quat=feet.quat[part], contact=feet.contact[part], shift=feet.shift[part])


def _reverse(feet: FootTargets) -> FootTargets:
    return FootTargets(pos=feet.pos[::-1], quat=feet.quat[::-1], contact=feet.contact[::-1], shift=feet.shift[::-1])
