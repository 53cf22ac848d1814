"""Hands turned as the person's: angles of the wrist that bring the robot's hand there from where its forearm is.

They go where the solver stays near what nothing else asks for, so that arms come first, and what a wrist cannot reach is
left at the end of its range.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import HumanClip
from retarget.targets import hand_frames
from robot_models import FEET, RobotModel, forward_kinematics, joint_axes
from robot_models.maths import rotation as rot
from robot_models.maths import smooth

_JOINTS = 3  # of a wrist that can turn a hand any way
_STEPS, _DAMPING = 12, 0.03  # of the wrist's least squares; weight of a joint's angle against a radian of the hand [1]
_CALM_HZ = 8.0  # of the angles: hands shake as their sensors do
_REACHED = np.radians(5.0)  # off where it shall be, of a hand whose wrist can


@lru_cache(maxsize=16)
def wrists(robot: RobotModel) -> dict[str, list[int]]:
    """Joints between elbow and hand, by side, of a robot whose wrists can turn a hand any way; {} of any other."""
    found = {side: [joint for joint, _, _ in _chain(robot, side)] for side in FEET}
    return found if all(len(joints) >= _JOINTS for joints in found.values()) else {}


@lru_cache(maxsize=32)
def _chain(robot: RobotModel, side: str) -> list[tuple[int, Float[ndarray, "4"], Float[ndarray, "3"]]]:
    """From the elbow outwards: a joint, the turn before it from the joint before, and its axis in its body."""
    model, chain = robot.model, list[tuple[int, ndarray, ndarray]]()
    body, elbow = (robot.body_ids[robot.landmark(f"{side}_{part}")] for part in ("wrist", "elbow"))
    while body not in (0, elbow):
        if model.body_jntnum[body]:
            hinge = int(model.body_jntadr[body])
            joint = robot.joint_names.index(model.joint(hinge).name)
            chain.insert(0, (joint, np.array(model.body_quat[body]), np.array(model.jnt_axis[hinge])))
        else:  # a body that is welded on the way: its turn comes before the joint's beyond it
            joint, turn, axis = chain[0]
            chain[0] = joint, rot.multiply(np.array(model.body_quat[body]), turn), axis
        body = int(model.body_parentid[body])
    return chain


def hand_goals(source: HumanClip, robot: RobotModel) -> dict[str, Float[ndarray, "T 4"]]:
    """Wanted orientations of the robot's hands; {} where the source has none or the robot's wrists cannot.

    Args:
        source: the figure at the robot's frame rate.
        robot: the robot.
    """
    frames = {side: hand_frames(source, side) for side in wrists(robot)}
    if not frames or any(f is None for f in frames.values()):
        return {}
    _, zero = forward_kinematics(robot, robot.zero_qpos[None])
    goals = {}
    for side, frame in frames.items():
        own = rot.multiply(rot.conjugate(_hand_at_zero(robot)[side]), zero[0, robot.landmark(f"{side}_wrist")])
        assert frame is not None
        goals[side] = rot.continuous(rot.multiply(frame, np.broadcast_to(own, frame.shape)))
    return goals


def hold_hands(
    robot: RobotModel, qpos: Float[ndarray, "T nq"], goals: Mapping[str, Float[ndarray, "T 4"]], fps: float
) -> Float[ndarray, "T nq"]:
    """The same poses with wrists that turn the hands to their goals, inside their ranges and without haste.

    Args:
        robot: the robot.
        qpos: poses whose forearms are where they shall be.
        goals: as `hand_goals` gives them; {} leaves all as it is.
        fps: frames per second.
    """
    held = np.array(qpos)
    _, quat = forward_kinematics(robot, qpos)
    for side, goal in goals.items():
        joints = wrists(robot)[side]
        angles, _ = _solve(robot, quat[:, robot.landmark(f"{side}_elbow")], side, goal)
        calm = smooth(angles, fps, _CALM_HZ)
        held[:, [7 + j for j in joints]] = np.clip(calm, robot.lower[joints], robot.upper[joints])
    return held


def hand_errors(
    robot: RobotModel, qpos: Float[ndarray, "T nq"], goals: Mapping[str, Float[ndarray, "T 4"]]
) -> tuple[Float[ndarray, "T S"], Bool[ndarray, "T S"]]:
    """How far the hands are from their goals [rad], and where the wrists could bring them there from the forearms as they are."""
    _, quat = forward_kinematics(robot, qpos)
    off, can = [], []
    for side, goal in goals.items():
        off.append(rot.angle_between(quat[:, robot.landmark(f"{side}_wrist")], goal))
        _, miss = _solve(robot, quat[:, robot.landmark(f"{side}_elbow")], side, goal)
        can.append(miss < _REACHED)
    return np.stack(off, axis=1), np.stack(can, axis=1)


@lru_cache(maxsize=16)
def _hand_at_zero(robot: RobotModel) -> dict[str, Float[ndarray, "4"]]:
    """Frames of the robot's hands at zero: x along the forearm, z to where the elbow bends it, which is the thumb's side."""
    pos, _, axes, anchors = (a[0] for a in joint_axes(robot, robot.zero_qpos[None]))
    frames = {}
    for side in FEET:
        shoulder, elbow, wrist = (pos[robot.landmark(f"{side}_{part}")] for part in ("shoulder", "elbow", "wrist"))
        joint = robot.landmark(f"{side}_elbow") - 1  # body i + 1 is moved by joint i
        way = np.cross(axes[joint], wrist - anchors[joint])
        nearer = float(way @ (shoulder - wrist)) / max(
            float(np.linalg.norm(way) * np.linalg.norm(shoulder - wrist)), 1e-9
        )
        middle = float(robot.lower[joint] + robot.upper[joint])
        bends = np.sign(nearer) if abs(nearer) > 0.1 else np.sign(middle)
        along = rot.unit(wrist - elbow)
        frames[side] = rot.from_axes(along, np.cross(bends * way, along))
    return frames


def _solve(
    robot: RobotModel, forearm: Float[ndarray, "T 4"], side: str, goal: Float[ndarray, "T 4"]
) -> tuple[Float[ndarray, "T J"], Float[ndarray, "T"]]:
    """Angles of a wrist by damped least squares inside its ranges, and how far from its goal the hand stays [rad]."""
    joints = wrists(robot)[side]
    low, high = robot.lower[joints], robot.upper[joints]
    angles = np.tile(np.clip(0.0, low, high), (len(goal), 1))
    for _ in range(_STEPS):
        hand, axes = _turned(robot, forearm, side, angles)
        error = rot.log(rot.multiply(goal, rot.conjugate(hand)))
        turns = np.moveaxis(axes, 1, 2)  # T 3 J: how the hand turns with each joint
        normal = np.swapaxes(turns, 1, 2) @ turns + _DAMPING**2 * np.eye(len(joints))
        rhs = np.swapaxes(turns, 1, 2) @ error[..., None] - _DAMPING**2 * angles[..., None]
        angles = np.clip(angles + np.clip(np.linalg.solve(normal, rhs)[..., 0], -0.5, 0.5), low, high)
    return angles, rot.angle_between(_turned(robot, forearm, side, angles)[0], goal)


def _turned(
    robot: RobotModel, forearm: Float[ndarray, "T 4"], side: str, angles: Float[ndarray, "T J"]
) -> tuple[Float[ndarray, "T 4"], Float[ndarray, "T J 3"]]:
    """The hand's orientation, and the wrist's axes, in the world."""
    quat, axes = forearm, []
    for k, (_, before, axis) in enumerate(_chain(robot, side)):
        quat = rot.multiply(quat, np.broadcast_to(before, quat.shape))
        axes.append(rot.rotate(quat, np.broadcast_to(axis, (len(quat), 3))))
        quat = rot.multiply(quat, rot.exp(angles[:, k, None] * axis))
    return quat, np.stack(axes, axis=1)
