"""Forward kinematics of whole clips, or of many environments, at once: level by level down the tree; and the mirror image.

The mirror is the plane that the robot's x and z axes span: places and velocities change the sign of y, turns and angular
velocities the signs of x and z, and left and right change places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models.maths import Array
from robot_models.maths import rotation as rot
from robot_models.model import RobotModel
from robot_models.profile import FEET

POLAR, AXIAL = np.array((1.0, -1.0, 1.0)), np.array((-1.0, 1.0, -1.0))
"""What the mirror multiplies places and velocities by, and turns and angular velocities."""
_CLOSE = 1e-3  # how far axes and places [m] of the two sides may differ


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyStates:
    """World poses and velocities of the robot's bodies. N is frames or environments."""

    pos: Float[Array, "N B 3"]  # [m]
    quat: Float[Array, "N B 4"]  # wxyz, world_from_body
    lin_vel: Float[Array, "N B 3"]  # of the body origin [m/s]
    ang_vel: Float[Array, "N B 3"]  # [rad/s]


def forward_kinematics(
    robot: RobotModel, qpos: Float[ndarray, "T nq"]
) -> tuple[Float[ndarray, "T B 3"], Float[ndarray, "T B 4"]]:
    """World positions [m] and orientations (wxyz, sign-continuous in time) of the robot's bodies.

    Args:
        robot: the robot; B follows its `body_names`.
        qpos: root position [m], root wxyz, joint angles [rad] in `joint_names` order.
    """
    pos, quat, _ = _poses(robot, qpos)
    return pos, rot.continuous(quat)


def body_states(robot: RobotModel, qpos: Float[ndarray, "N nq"], qvel: Float[ndarray, "N nv"]) -> BodyStates:
    """Poses and velocities of all bodies from MuJoCo's state: one pass outwards.

    qvel has MuJoCo's layout: root linear velocity in the world frame, root angular velocity in the body frame.
    """
    pos, quat, axes = _poses(robot, qpos)
    lin, ang = np.zeros_like(pos), np.zeros_like(pos)
    lin[:, 0], ang[:, 0] = qvel[:, :3], rot.rotate(quat[:, 0], qvel[:, 3:6])
    for depth_level in _depths(robot):
        b, p = depth_level.bodies, depth_level.parents
        carried = ang[:, p] + 0.0
        spin = axes[:, b] * qvel[:, 6 + depth_level.joints, None]
        # The joint's anchor moves with the parent; the body turns about it with both.
        arm = rot.rotate(quat[:, b], np.broadcast_to(depth_level.anchors, (len(qpos), len(b), 3)))
        anchor = pos[:, b] + arm
        ang[:, b] = carried + spin
        lin[:, b] = lin[:, p] + rot.cross(carried, anchor - pos[:, p]) - rot.cross(ang[:, b], arm)
    return BodyStates(pos=pos, quat=quat, lin_vel=lin, ang_vel=ang)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Depth:
    """Bodies at one depth of the tree; their parents stand on levels before. Fixed bodies are folded in."""

    bodies: ndarray
    parents: ndarray
    joints: ndarray
    pos: ndarray  # of the body in its parent, at zero
    quat: ndarray
    axes: ndarray
    anchors: ndarray


@lru_cache(maxsize=16)
def _depths(robot: RobotModel) -> tuple[_Depth, ...]:
    m = robot.model
    place = {b: i for i, b in enumerate(robot.body_ids)}
    rows: dict[int, list[tuple[Any, ...]]] = {}
    depth = {robot.body_ids[0]: 0}
    for body in robot.body_ids[1:]:
        pos, quat = np.array(m.body_pos[body]), np.array(m.body_quat[body])
        parent = int(m.body_parentid[body])
        while parent not in place:  # a fixed body between two joints
            pos = m.body_pos[parent] + rot.rotate(m.body_quat[parent], pos)
            quat = rot.multiply(m.body_quat[parent], quat)
            parent = int(m.body_parentid[parent])
        depth[body] = depth[parent] + 1
        joint = int(m.body_jntadr[body])
        row = (place[body], place[parent], place[body] - 1, pos, quat, m.jnt_axis[joint], m.jnt_pos[joint])
        rows.setdefault(depth[body], []).append(row)
    return tuple(
        _Depth(**dict(zip(_Depth.__dataclass_fields__, map(np.array, zip(*rows[d], strict=True)), strict=True)))
        for d in sorted(rows)
    )


def joint_axes(
    robot: RobotModel, qpos: Float[ndarray, "T nq"]
) -> tuple[Float[ndarray, "T B 3"], Float[ndarray, "T B 4"], Float[ndarray, "T J 3"], Float[ndarray, "T J 3"]]:
    """Body positions and orientations, and each joint's axis and anchor, all in the world."""
    pos, quat, axes = _poses(robot, qpos)
    anchors = pos[:, 1:].copy()
    for depth_level in _depths(robot):
        if depth_level.anchors.any():
            anchors[:, depth_level.joints] += rot.rotate(quat[:, depth_level.bodies], depth_level.anchors)
    return pos, quat, axes[:, 1:], anchors


def _poses(robot: RobotModel, qpos: Float[ndarray, "N nq"]) -> tuple[ndarray, ndarray, ndarray]:
    """Positions, orientations and world joint axes of all bodies, level by level down the tree."""
    count = len(qpos)
    pos = np.zeros((count, len(robot.body_names), 3))
    quat = np.zeros((count, len(robot.body_names), 4))
    axes = np.zeros_like(pos)
    pos[:, 0], quat[:, 0] = qpos[:, :3], rot.normalise(qpos[:, 3:7])
    for depth_level in _depths(robot):
        parent = quat[:, depth_level.parents]
        rest = rot.multiply(parent, depth_level.quat)
        # MuJoCo turns a body about its joint's anchor, which need not be the body's origin.
        half = 0.5 * qpos[:, 7 + depth_level.joints, None]
        turned = rot.multiply(rest, np.concatenate((np.cos(half), np.sin(half) * depth_level.axes), axis=-1))
        shift = (
            rot.rotate(rest, depth_level.anchors) - rot.rotate(turned, depth_level.anchors)
            if depth_level.anchors.any()
            else 0.0
        )
        pos[:, depth_level.bodies] = pos[:, depth_level.parents] + rot.rotate(parent, depth_level.pos) + shift
        quat[:, depth_level.bodies] = turned
        axes[:, depth_level.bodies] = rot.rotate(rest, depth_level.axes)
    return pos, quat, axes


def sole_corners(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T 2 4 3"]:
    """World positions of the four corners (two back, two front) of the left and the right sole [m]."""
    feet = []
    for sole in robot.soles.values():
        b = robot.body(sole.body)
        feet.append(body_pos_w[:, None, b] + rot.rotate(body_quat_w[:, None, b], sole.corners[None]))
    return np.stack(feet, axis=1)


def heel_toe_positions(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T 4 3"]:
    """World positions of left heel, left toe, right heel, right toe: middles of the soles' edges [m]."""
    corners = sole_corners(robot, body_pos_w, body_quat_w)
    return corners.reshape(len(corners), 4, 2, 3).mean(axis=2)


@lru_cache(maxsize=16)
def leg_length(robot: RobotModel) -> float:
    """Hip to knee to ankle along the zero pose [m], mean of both legs."""
    pos, _ = forward_kinematics(robot, robot.zero_qpos[None])
    legs = [pos[0, [robot.landmark(f"{side}_{part}") for part in ("hip", "knee", "foot")]] for side in FEET]
    return float(np.mean([np.linalg.norm(np.diff(leg, axis=0), axis=-1).sum() for leg in legs]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflection:
    """What numbers are in the mirror: `sign * numbers[..., order]`."""

    order: Int[ndarray, "K"]
    sign: Float[ndarray, "K"]

    def of(self, numbers: Float[ndarray, "... K"]) -> Float[ndarray, "... K"]:
        """The numbers of the mirror image."""
        return np.asarray(self.sign * numbers[..., self.order])


def reflected_joints(robot: RobotModel) -> Reflection | None:
    """The joint angles of a robot's mirror image; None where its two sides are not alike."""
    pos, _, axes, _ = joint_axes(robot, robot.zero_qpos[None])
    bodies, joints = (other_side(names) for names in (robot.body_names, robot.joint_names))
    if bodies is None or joints is None:
        return None
    turned = np.einsum("ji,ji->j", axes[0, joints], AXIAL * axes[0])
    sign, rest = np.sign(turned), robot.default_joint_pos
    differences = (np.abs(turned) - 1.0, pos[0, bodies] - POLAR * pos[0], sign * rest[joints] - rest)
    if max(np.abs(d).max() for d in differences) > _CLOSE:
        return None
    return Reflection(order=joints, sign=sign)


def other_side(names: Sequence[str]) -> Int[ndarray, "K"] | None:
    """Where each name's counterpart stands; names without a side are their own. None where one has no counterpart."""
    swap = {"left": "right", "right": "left"}
    others = ["_".join(swap.get(word, word) for word in name.split("_")) for name in names]
    if not set(others) <= set(names):
        return None
    return np.array([list(names).index(other) for other in others])
