"""Lead-in and lead-out: from standing still into the first pose and back, with the feet where the dance has them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import FREE, PLANTED
from retarget.config import RetargetConfig
from retarget.targets.contacts import UNSTATED
from retarget.targets.feet import FootTargets, smoothstep
from retarget.targets.floor_parts import no_parts
from retarget.targets.targets import Targets, join
from robot_models import FEET, RobotModel, forward_kinematics
from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionWithLeads:
    """A rough motion and its targets, with leads."""

    qpos: Float[ndarray, "T nq"]
    targets: Targets
    segments: Int[ndarray, "S 3"]
    names: tuple[str, ...]

    @property
    def dance(self) -> slice:
        """Frames of the dance itself; from the first to the last of several."""
        dances = self.segments[np.flatnonzero(np.array(self.names) == "dance")]
        return slice(int(dances[0, 0]), int(dances[-1, 1]))


def add_leads(
    robot: RobotModel, qpos: Float[ndarray, "T nq"], targets: Targets, config: RetargetConfig
) -> MotionWithLeads:
    """Put a stand and a blend before and after the dance, where it does not begin or end on the floor.

    The stand takes the feet's places from the dance's end pose, set flat on the floor; a foot that is in the air
    there lifts off during the blend. The targets of the leads are the blend's own poses.
    """
    head = _lead(robot, qpos[0], _frame(targets.feet, 0), config, config.lead_in_s)
    tail = _lead(robot, qpos[-1], _frame(targets.feet, -1), config, config.lead_out_s)
    parts, names = [(qpos, targets)], ["dance"]
    if head is not None:
        parts, names = [(head[0], targets_of(robot, *head, targets)), *parts], ["lead-in", *names]
    if tail is not None:
        backwards = tail[0][::-1], _reverse(tail[1])
        parts, names = [*parts, (backwards[0], targets_of(robot, *backwards, targets))], [*names, "lead-out"]
    ends = np.cumsum([len(q) for q, _ in parts])
    starts = np.concatenate(([0], ends[:-1]))
    return MotionWithLeads(
        qpos=np.concatenate([q for q, _ in parts]),
        targets=join([t for _, t in parts]),
        segments=np.array([(a, b, int(i > 0)) for i, (a, b) in enumerate(zip(starts, ends, strict=True))]),
        names=tuple(names),
    )


def targets_of(robot: RobotModel, qpos: ndarray, feet: FootTargets, like: Targets) -> Targets:
    """A robot motion as targets for itself, with feet of their own."""
    pos, quat = forward_kinematics(robot, qpos)
    place = robot.landmark
    return replace(
        like,
        pelvis_pos=pos[:, 0],
        pelvis_quat=quat[:, 0],
        torso_quat=quat[:, place("torso")],
        limbs={(a, b): pos[:, place(b)] - pos[:, place(a)] for a, b in like.limbs},
        feet=feet,
        airborne=np.zeros(len(qpos), dtype=bool),
        parts=no_parts(len(qpos)),
        stated=np.full((len(qpos), 4), UNSTATED),
    )


def _lead(
    robot: RobotModel, end: ndarray, feet: FootTargets, config: RetargetConfig, duration_s: float
) -> tuple[ndarray, FootTargets] | None:
    """Frames from the stand up to, but without, the pose `end`."""
    if duration_s <= 0.0 or not robot.on_its_feet(end[:3], end[3:7]):
        return None  # no blend brings a robot from a stand onto the floor: that is a dance of its own
    stand, stand_feet = _stand(robot, end, feet)
    still = round(config.stand_s * config.fps)
    moving = blend_frames(robot, stand, end, config.fps, duration_s)
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


def blend_frames(
    robot: RobotModel, start: Float[ndarray, "nq"], end: Float[ndarray, "nq"], fps: float, shortest_s: float
) -> int:
    """Frames of a blend whose top speed, 15/8 of its mean (minimum jerk), stays under half of every motor's."""
    needed = np.abs(end[7:] - start[7:]) / (0.5 * robot.velocity) * 1.875
    return int(np.ceil(max(shortest_s, float(needed.max())) * fps))


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
    pos, _ = forward_kinematics(robot, robot.default_qpos[None])
    return pos[0, 0] - pos[0, [robot.landmark(f"{s}_foot") for s in FEET]].mean(axis=0)


def _frame(feet: FootTargets, t: int) -> FootTargets:
    part = slice(t, None) if t == -1 else slice(t, t + 1)
    return FootTargets(pos=feet.pos[part], quat=feet.quat[part], contact=feet.contact[part], shift=feet.shift[part])


def _reverse(feet: FootTargets) -> FootTargets:
    return FootTargets(pos=feet.pos[::-1], quat=feet.quat[::-1], contact=feet.contact[::-1], shift=feet.shift[::-1])
