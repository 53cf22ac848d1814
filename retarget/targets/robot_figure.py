"""Joint-space clips: a robot's recording seen as a figure of named points, so that every clip takes one road."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Clip, HumanClip, RobotClip, full_qpos, mirror
from retarget.targets.targets import Targets
from robot_models import FEET, RobotModel, forward_kinematics, leg_length, load_robot, reflected_joints
from robot_models.maths import rotation as rot

_PARENTS = {
    "hip": "pelvis", "knee": "hip", "foot": "knee", "toe": "foot", "shoulder": "torso", "elbow": "shoulder", "wrist": "elbow",
}  # fmt: skip


def as_figure(clip: RobotClip, robot: RobotModel | None = None) -> HumanClip:
    """The points of a robot's landmarks by forward kinematics, with the orientations of their bodies.

    Orientations are taken relative to the zero pose, in which every body is upright and faces +x, so that they mean
    the same on every robot.
    """
    robot = robot or load_robot(clip.robot)
    pos, quat = forward_kinematics(robot, full_qpos(clip, robot))
    _, zero_quat = forward_kinematics(robot, robot.zero_qpos[None])
    names, points, turns = [], [], []
    for landmark in robot.profile.landmarks:
        body = robot.landmark(landmark)
        names.append(landmark)
        points.append(robot.landmark_pos((landmark,), pos, quat)[:, 0])
        turns.append(
            rot.multiply(quat[:, body], np.broadcast_to(rot.conjugate(zero_quat[0, body]), quat[:, body].shape))
        )
    for side in FEET:
        foot, sole = robot.landmark(f"{side}_foot"), robot.soles[side]
        names.append(f"{side}_toe")
        points.append(pos[:, foot] + rot.rotate(quat[:, foot], np.broadcast_to(sole.toe, pos[:, foot].shape)))
        turns.append(turns[names.index(f"{side}_foot")])
    return HumanClip(
        fps=clip.fps,
        names=tuple(names),
        positions=np.stack(points, axis=1),
        orientations=rot.normalise(np.stack(turns, axis=1)),
        parents=tuple(_parent(n, names) for n in names),
        landmarks=_landmarks(names),
        height=float(leg_length(robot) / 0.491),
        source=clip.source.noting(f"joints of {robot.name} -> points by forward kinematics"),
        upright=True,
    )


def _landmarks(names: list[str]) -> dict[str, str]:
    renamed = {f"{s}_ankle": f"{s}_foot" for s in FEET} | {"chest": "torso"}
    return {n: n for n in names if n not in renamed.values() and n != "head"} | renamed


def _parent(name: str, names: list[str]) -> int:
    side, _, part = name.rpartition("_")
    if part == "pelvis":
        return -1
    above = _PARENTS.get(part, "pelvis")
    return names.index(above if above in names else f"{side}_{above}")


def mirrored(clip: Clip) -> Clip:
    """The mirror image of any clip; a robot that is not its own mirror image is mirrored as the figure that it makes."""
    if isinstance(clip, RobotClip) and reflected_joints(load_robot(clip.robot)) is None:
        return mirror(as_figure(clip))
    return mirror(clip)


def of_this_robot(recorded: Clip, robot: RobotModel) -> bool:
    """Whether a clip was made on the robot that shall dance it."""
    return isinstance(recorded, RobotClip) and recorded.robot == robot.name


def posture_of(recorded: Clip, robot: RobotModel, targets: Targets) -> Float[ndarray, "T nq"]:
    """Where to start and what to stay near: the recording, where it was made on this very robot, else the default."""
    if isinstance(recorded, RobotClip) and of_this_robot(recorded, robot):
        return full_qpos(recorded, robot)
    qpos = np.tile(robot.default_qpos, (len(targets.pelvis_pos), 1))
    qpos[:, :3], qpos[:, 3:7] = targets.pelvis_pos, targets.pelvis_quat
    return qpos
