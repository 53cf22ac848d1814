"""Forward kinematics of whole clips at once: one pass down the tree, vectorised over frames."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import rotation as rot
from robot_models.robot import RobotModel


def forward_kinematics(
    robot: RobotModel, qpos: Float[ndarray, "T nq"]
) -> tuple[Float[ndarray, "T B 3"], Float[ndarray, "T B 4"]]:
    """World positions [m] and orientations (wxyz) of the robot's bodies.

    Args:
        robot: the robot; B follows its `body_names`.
        qpos: root position [m], root wxyz, joint angles [rad] in `joint_names` order.
    """
    m, frames = robot.model, len(qpos)
    pos = np.zeros((m.nbody, frames, 3))
    quat = np.zeros((m.nbody, frames, 4))
    quat[0, :, 0] = 1.0
    root = robot.body_ids[0]
    pos[root], quat[root] = qpos[:, :3], rot.normalise(qpos[:, 3:7])
    for body in range(root + 1, m.nbody):
        parent = m.body_parentid[body]
        pos[body] = pos[parent] + rot.rotate(quat[parent], np.broadcast_to(m.body_pos[body], (frames, 3)))
        quat[body] = rot.multiply(quat[parent], np.broadcast_to(m.body_quat[body], (frames, 4)))
        if m.body_jntnum[body]:
            joint = m.body_jntadr[body]
            turn = rot.exp(qpos[:, m.jnt_qposadr[joint], None] * m.jnt_axis[joint])
            anchor = np.broadcast_to(m.jnt_pos[joint], (frames, 3))
            # MuJoCo turns the body about its joint anchor, which need not be the body origin.
            pos[body] += rot.rotate(quat[body], anchor)
            quat[body] = rot.multiply(quat[body], turn)
            pos[body] -= rot.rotate(quat[body], anchor)
    ids = list(robot.body_ids)
    return pos[ids].swapaxes(0, 1).copy(), rot.continuous(rot.normalise(quat[ids].swapaxes(0, 1)))


def sole_corners(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T 2 4 3"]:
    """World positions of the four corners (two back, two front) of the left and the right sole [m]."""
    feet = []
    for sole in robot.soles.values():
        b = robot.body(sole.body)
        feet.append(body_pos_w[:, None, b] + rot.rotate(body_quat_w[:, None, b], sole.corners[None]))
    return np.stack(feet, axis=1)


def sole_edges(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T 4 3"]:
    """World positions of left heel, left toe, right heel, right toe: middles of the soles' edges [m]."""
    corners = sole_corners(robot, body_pos_w, body_quat_w)
    return corners.reshape(len(corners), 4, 2, 3).mean(axis=2)
