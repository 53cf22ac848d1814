"""Gains that stand: stiffer than gravity is strong, by a pendulum that is tipped and weighed here."""

import copy
import dataclasses

import mujoco
import numpy as np
import pytest

from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.policy.gains import standing_gains

ROBOTS = pytest.mark.parametrize("name", ["dancer", "g1"])


def toppling(robot):
    """How fast gravity's torque about the ankles grows as the stiff robot tips forwards [N m/rad], from its energy."""
    m, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = robot.default_qpos
    mujoco.mj_kinematics(m, data)
    feet = [robot.body_ids[robot.body(s.body)] for s in robot.soles.values()]
    ankles = data.xpos[feet].mean(axis=0)

    def energy(angle):
        turn = rot.exp(np.array([0.0, angle, 0.0]))
        data.qpos[:3] = ankles + rot.rotate(turn, robot.default_qpos[:3] - ankles)
        data.qpos[3:7] = rot.multiply(turn, robot.default_qpos[3:7])
        mujoco.mj_kinematics(m, data)
        mujoco.mj_comPos(m, data)
        return 9.81 * (m.body_mass[:, None] * data.xipos).sum(axis=0)[2]

    h = 1e-3
    return -(energy(h) - 2.0 * energy(0.0) + energy(-h)) / h**2


def pitch_stiffness(robot, kp):
    """Of two legs beside each other, each a row of springs: ankle, knee and hip that bend forwards [N m/rad]."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = robot.zero_qpos
    mujoco.mj_kinematics(robot.model, data)
    both = 0.0
    for side in ("left", "right"):
        row = [
            i for i, n in enumerate(robot.joint_names)
            if n.startswith(side) and any(k in n for k in ("hip_pitch", "knee", "ankle_pitch"))
        ]  # fmt: skip
        assert len(row) == 3
        both += 1.0 / (1.0 / kp[row]).sum()
    return both


@ROBOTS
def test_legs_are_stiffer_than_gravity_topples(name):
    robot = load_robot(name)
    kp, _ = standing_gains(robot)
    assert toppling(robot) > 50.0
    assert 1.1 * toppling(robot) < pitch_stiffness(robot, kp)


def test_the_gains_of_a_soft_policy_are_not():
    robot = load_robot("g1")
    assert pitch_stiffness(robot, robot.kp) < toppling(robot)


@ROBOTS
def test_no_joint_becomes_softer_none_above_the_trunk_changes_and_damping_ratios_stay(name):
    robot = load_robot(name)
    kp, kd = standing_gains(robot)
    assert (kp >= robot.kp).all()
    np.testing.assert_allclose(kd / np.sqrt(kp), robot.kd / np.sqrt(robot.kp))
    arms = [i for i, n in enumerate(robot.joint_names) if any(k in n for k in ("shoulder", "elbow", "wrist"))]
    np.testing.assert_array_equal(kp[arms], robot.kp[arms])
    np.testing.assert_array_equal(kd[arms], robot.kd[arms])
    left, right = (kp[[i for i, n in enumerate(robot.joint_names) if n.startswith(s)]] for s in ("left", "right"))
    np.testing.assert_array_equal(left, right)


def test_a_robot_twice_as_heavy_stands_on_springs_twice_as_stiff():
    robot = load_robot("g1")
    model = copy.copy(robot.model)
    model.body_mass[:] *= 2.0
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    heavy, light = (standing_gains(r)[0] for r in (dataclasses.replace(robot, model=model), robot))
    stiffened = light > robot.kp
    assert stiffened.sum() >= 12  # the legs of g1 are soft in the policy
    np.testing.assert_allclose(heavy[stiffened], 2.0 * light[stiffened])


def test_gains_that_stand_already_are_left_alone():
    robot = load_robot("g1")
    stiff = dataclasses.replace(robot, kp=1e6 * np.ones_like(robot.kp))
    kp, kd = standing_gains(stiff)
    np.testing.assert_array_equal(kp, stiff.kp)
    np.testing.assert_array_equal(kd, stiff.kd)
