"""Joints that no goal asks anything of."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.solver.free_joints import free_joints
from robot_models import FEET, forward_kinematics, load_robot


@pytest.mark.parametrize("name", ["dancer", "g1"])
def test_the_wrists_are_free_and_nothing_else(name: str) -> None:
    robot = load_robot(name)
    found = [n for n, free in zip(robot.joint_names, free_joints(robot), strict=True) if free]
    assert found == [n for n in robot.joint_names if "wrist" in n]


@pytest.mark.parametrize("name", ["dancer", "g1"])
def test_turning_a_free_joint_moves_no_limb(name: str) -> None:
    robot = load_robot(name)
    qpos = np.tile(robot.default_qpos, (1 + len(robot.joint_names), 1))
    qpos[np.arange(1, len(qpos)), 7 + np.arange(len(robot.joint_names))] += 0.3
    pos, _ = forward_kinematics(robot, qpos)
    ends = [robot.landmark(f"{side}_{part}") for side in FEET for part in ("knee", "foot", "elbow", "wrist")]
    moved = np.linalg.norm(pos[1:, ends] - pos[0, ends], axis=2).max(axis=1)
    free = free_joints(robot)
    assert moved[free].max() < 0.03  # [m]
    swing = np.array([any(p in n for p in ("hip_pitch", "knee", "shoulder_pitch", "elbow")) for n in robot.joint_names])
    assert moved[swing].min() > 0.03
