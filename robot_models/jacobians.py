"""Derivatives of body poses for whole clips at once.

The tangent of a configuration is [root translation in the world, root rotation in the world, joints]: unlike MuJoCo's
qvel its rotation is a world vector (left multiplication), which keeps every formula in one frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from robot_models import rotation as rot
from robot_models.kinematics import joint_axes
from robot_models.robot import RobotModel


@dataclass(frozen=True, kw_only=True, eq=False)
class Kinematics:
    """Poses of all bodies and what their derivatives are made of. T frames, B bodies, J joints."""

    robot: RobotModel
    pos: Float[ndarray, "T B 3"]  # [m]
    quat: Float[ndarray, "T B 4"]  # wxyz
    axes: Float[ndarray, "T J 3"]  # joint axes in the world
    anchors: Float[ndarray, "T J 3"]  # points on the joint axes [m]

    def point_jacobian(self, body: int, points_w: Float[ndarray, "T 3"]) -> Float[ndarray, "T 3 nv"]:
        """Derivative of a world point that moves with a body."""
        carried = ancestors(self.robot)[body]
        out = np.zeros((len(points_w), 3, 6 + len(carried)))
        out[:, [0, 1, 2], [0, 1, 2]] = 1.0
        # w x r is -[r]x w.
        x, y, z = np.moveaxis(points_w - self.pos[:, 0], -1, 0)
        out[:, 0, 4], out[:, 0, 5] = z, -y
        out[:, 1, 3], out[:, 1, 5] = -z, x
        out[:, 2, 3], out[:, 2, 4] = y, -x
        joints = np.flatnonzero(carried)
        turned = rot.cross(self.axes[:, joints], points_w[:, None] - self.anchors[:, joints])
        out[:, :, 6 + joints] = turned.swapaxes(1, 2)
        return out

    def turn_jacobian(self, body: int) -> Float[ndarray, "T 3 nv"]:
        """Derivative of a body's orientation, as a rotation vector in the world."""
        carried = ancestors(self.robot)[body]
        out = np.zeros((len(self.pos), 3, 6 + len(carried)))
        out[:, [0, 1, 2], [3, 4, 5]] = 1.0
        joints = np.flatnonzero(carried)
        out[:, :, 6 + joints] = self.axes[:, joints].swapaxes(1, 2)
        return out


def kinematics(robot: RobotModel, qpos: Float[ndarray, "T nq"]) -> Kinematics:
    """Poses and joint axes of all frames."""
    pos, quat, axes, anchors = joint_axes(robot, qpos)
    return Kinematics(robot=robot, pos=pos, quat=quat, axes=axes, anchors=anchors)


def integrate(qpos: Float[ndarray, "T nq"], step: Float[ndarray, "T nv"]) -> Float[ndarray, "T nq"]:
    """Configurations after a step in the tangent of this module."""
    out = np.array(qpos)
    out[:, :3] += step[:, :3]
    out[:, 3:7] = rot.normalise(rot.multiply(rot.exp(step[:, 3:6]), qpos[:, 3:7]))
    out[:, 7:] += step[:, 6:]
    return out


@lru_cache(maxsize=16)
def ancestors(robot: RobotModel) -> Bool[ndarray, "B J"]:
    """Which joints carry which body."""
    m = robot.model
    joint_of = {b: i - 1 for i, b in enumerate(robot.body_ids)}
    out = np.zeros((len(robot.body_ids), len(robot.joint_names)), dtype=bool)
    for i, body in enumerate(robot.body_ids):
        while body != robot.body_ids[0]:
            if body in joint_of:
                out[i, joint_of[body]] = True
            body = int(m.body_parentid[body])
    return out
