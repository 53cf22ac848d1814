"""Servo gains: a policy's, which robot and task take from its contract, and those that stand without a policy."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import FEET, RobotModel
from tracking.policy.contract import Contract

# Hip, knee and ankle bend one after another: three springs in a row are a third as stiff as one.
_MARGIN = 3.0 * 1.3


def standing_gains(robot: RobotModel) -> tuple[Float[ndarray, "J"], Float[ndarray, "J"]]:
    """Gains kp, kd for standing in the default pose on position servos alone.

    An inverted pendulum of weight m g with its centre at height h stands on two ankles of stiffness k each as long as
    2 k > m g h. All joints between soles and trunk get more than three times that, because they bend in a row; the damping
    grows with the root, so that the damping ratio stays.
    """
    import mujoco

    m, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = robot.default_qpos
    mujoco.mj_forward(m, data)
    ankles = np.mean([data.xpos[robot.body_ids[robot.body(robot.soles[side].body)], 2] for side in FEET])
    weight = 9.81 * m.body_mass.sum()
    least = _MARGIN * 0.5 * weight * (data.subtree_com[robot.body_ids[0], 2] - ankles)
    carrying = sorted({joint for name in _carriers(robot) for joint in _joints_to(robot, name)})
    kp = robot.kp.copy()
    kp[carrying] = np.maximum(kp[carrying], least)
    return kp, robot.kd * np.sqrt(kp / robot.kp)


def _carriers(robot: RobotModel) -> tuple[str, ...]:
    return (*(robot.soles[side].body for side in FEET), robot.profile.anchor)


def _joints_to(robot: RobotModel, body: str) -> set[int]:
    """Places of the joints between the root and a body."""
    m, joints = robot.model, set()
    at = robot.body_ids[robot.body(body)]
    while at != robot.body_ids[0]:
        first = int(m.body_jntadr[at])
        joints |= {robot.joint(m.joint(first + k).name) for k in range(m.body_jntnum[at])}
        at = int(m.body_parentid[at])
    return joints


def with_gains(robot: RobotModel, contract: Contract) -> RobotModel:
    """The robot with a policy's servo gains; joints that the policy does not know keep their own."""
    ids, model = [robot.joint(name) for name in contract.joint_names], copy.copy(robot.model)
    kp, kd = robot.kp.copy(), robot.kd.copy()
    kp[ids], kd[ids] = contract.kp, contract.kd
    model.actuator_gainprm[:, 0], model.actuator_biasprm[:, 1], model.actuator_biasprm[:, 2] = kp, -kp, -kd
    return replace(robot, model=model, kp=kp, kd=kd)
