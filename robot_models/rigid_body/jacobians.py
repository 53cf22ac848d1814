"""Derivatives of body poses for whole clips at once, as products of screws and wrenches.

The tangent of a configuration is [root translation in the world, root rotation in the world, joints]: unlike MuJoCo's
qvel its rotation is a world vector (left multiplication), which keeps every formula in one frame.

Every coordinate moves what it carries by a screw [angular velocity, velocity of the world's origin]; a unit force
along n at a point p is the wrench [p x n, n], a couple about n is [n, 0]. Their product is how fast p moves along n, or
the body turns about n (Murray, Li & Sastry 1994, section 2.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from robot_models.maths import rotation as rot
from robot_models.model import RobotModel
from robot_models.rigid_body.kinematics import joint_axes


@dataclass(frozen=True, kw_only=True, eq=False)
class Kinematics:
    """Poses of all bodies and what their derivatives are made of. T frames, B bodies."""

    robot: RobotModel
    pos: Float[ndarray, "T B 3"]  # [m]
    quat: Float[ndarray, "T B 4"]  # wxyz
    screws: Float[ndarray, "T nv 6"]  # per unit of each coordinate

    def at(self, frames: Int[ndarray, "F"] | slice) -> Kinematics:
        """Some of the frames."""
        return replace(self, pos=self.pos[frames], quat=self.quat[frames], screws=self.screws[frames])

    def derivatives(self, bodies: Int[ndarray, "*#T R"], wrenches: Float[ndarray, "T R 6"]) -> Float[ndarray, "T R nv"]:
        """How fast each body follows its wrench, per unit of every coordinate; bodies in all frames alike, or frame by frame."""
        out: ndarray = wrenches @ self.screws.swapaxes(1, 2)
        out *= moved(self.robot)[bodies]
        return out


def kinematics(robot: RobotModel, qpos: Float[ndarray, "T nq"]) -> Kinematics:
    """Poses and screws of all frames."""
    pos, quat, axes, anchors = joint_axes(robot, qpos)
    screws = np.zeros((len(qpos), 6 + axes.shape[1], 6))
    screws[:, :3, 3:] = np.eye(3)
    screws[:, 3:6, :3] = np.eye(3)
    screws[:, 3:6, 3:] = rot.cross(pos[:, :1], np.eye(3))
    screws[:, 6:, :3] = axes
    screws[:, 6:, 3:] = rot.cross(anchors, axes)
    return Kinematics(robot=robot, pos=pos, quat=quat, screws=screws)


def forces(points: Float[ndarray, "*batch 3"]) -> Float[ndarray, "*batch 3 6"]:
    """Wrenches of the three unit forces of the world at points."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    out = np.zeros((*points.shape[:-1], 3, 6))
    out[..., 0, 1], out[..., 0, 2] = z, -y
    out[..., 1, 0], out[..., 1, 2] = -z, x
    out[..., 2, 0], out[..., 2, 1] = y, -x
    out[..., 3:] = np.eye(3)
    return out


def integrate(qpos: Float[ndarray, "T nq"], step: Float[ndarray, "T nv"]) -> Float[ndarray, "T nq"]:
    """Configurations after a step in the tangent of this module."""
    out = np.array(qpos)
    out[:, :3] += step[:, :3]
    out[:, 3:7] = rot.normalise(rot.multiply(rot.exp(step[:, 3:6]), qpos[:, 3:7]))
    out[:, 7:] += step[:, 6:]
    return out


def tangents(qpos: Float[ndarray, "T nq"]) -> Float[ndarray, "Td nv"]:
    """The steps from each configuration to the next, in the tangent of this module."""
    step = np.diff(np.concatenate((qpos[:, :3], qpos[:, 4:7], qpos[:, 7:]), axis=1), axis=0)
    step[:, 3:6] = rot.log(rot.multiply(qpos[1:, 3:7], rot.conjugate(qpos[:-1, 3:7])))
    return step


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


@lru_cache(maxsize=16)
def moved(robot: RobotModel) -> Float[ndarray, "_ nv"]:
    """1 where a coordinate moves a body; the last row is the world's."""
    carried = ancestors(robot).astype(float)
    rooted = np.concatenate((np.ones((len(carried), 6)), carried), axis=1)
    return np.concatenate((rooted, np.zeros((1, rooted.shape[1]))))
