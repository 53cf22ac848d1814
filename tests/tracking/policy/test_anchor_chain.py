"""The chain from the IMU to the anchor leads where MuJoCo says."""

import copy
import dataclasses

import mujoco
import numpy as np
import pytest

from robot_models import RobotError, installed, load_robot
from robot_models.maths import rotation as rot
from tracking.policy.anchor_chain import anchor_chain


def walk(chain, joints):
    """Pose of the chain's end in the root's frame; `joints` by name [rad]."""
    pos, quat = np.zeros(3), rot.IDENTITY
    for link in chain:
        pos = pos + rot.rotate(quat, np.array(link.pos))
        quat = rot.multiply(quat, np.array(link.quat))
        if link.joint is not None:
            quat = rot.multiply(quat, rot.exp(joints[link.joint] * np.array(link.axis)))
    return pos, quat


def by_mujoco(robot, qpos, body):
    data, at = mujoco.MjData(robot.model), robot.body_ids[robot.body(body)]
    data.qpos[:] = qpos
    mujoco.mj_kinematics(robot.model, data)
    back = rot.conjugate(qpos[3:7])
    return rot.rotate(back, data.xpos[at] - qpos[:3]), rot.multiply(back, data.xquat[at])


def somewhere(robot, rng):
    qpos = robot.default_qpos.copy()
    qpos[:3], qpos[3:7] = rng.normal(size=3), rot.normalise(rng.normal(size=4))
    qpos[7:] += rng.uniform(-0.5, 0.5, size=len(robot.joint_names))
    return qpos, dict(zip(robot.joint_names, qpos[7:], strict=True))


def apart(ours, theirs):
    return max(np.linalg.norm(ours[0] - theirs[0]), rot.angle_between(ours[1], theirs[1]))


@pytest.mark.parametrize("name", ["dancer", "g1", "jvrc1", "talos"])
def test_the_chain_leads_to_every_tracked_body_in_any_pose(name, rng):
    if not installed(name):
        pytest.skip("its model is not on this machine")
    robot = load_robot(name)
    qpos, joints = somewhere(robot, rng)
    for body in robot.profile.tracked:
        assert apart(walk(anchor_chain(robot, body), joints), by_mujoco(robot, qpos, body)) < 1e-7, body


def test_a_chain_told_wrongly_leads_elsewhere(rng):
    robot = load_robot("g1")
    qpos, joints = somewhere(robot, rng)
    body = "left_wrist_yaw_link"
    chain, there = anchor_chain(robot, body), by_mujoco(robot, qpos, body)
    assert len(chain) > 5 and apart(walk(chain, joints), there) < 1e-7
    spoilt = {
        "a link missing": chain[:-1],
        "the other way round": chain[::-1],
        "xyzw": [dataclasses.replace(c, quat=(*c.quat[1:], c.quat[0])) for c in chain],
        "axes turned round": [dataclasses.replace(c, axis=tuple(-a for a in c.axis)) for c in chain],
    }
    for what, wrong in spoilt.items():
        assert apart(walk(wrong, joints), there) > 0.01, what
    right = [dataclasses.replace(c, joint=c.joint and c.joint.replace("left", "right")) for c in chain]
    assert apart(walk(right, joints), there) > 0.01


@pytest.mark.parametrize("known", [(), ("waist_yaw_joint",), None])
def test_joints_that_the_policy_does_not_know_stand_at_the_default_pose(known, rng):
    robot = load_robot("g1")
    qpos, joints = somewhere(robot, rng)
    chain = anchor_chain(robot, "left_wrist_yaw_link", known)
    for i, name in enumerate(robot.joint_names):
        if known is not None and name not in known:
            qpos[7 + i] = robot.default_joint_pos[i]
    assert {c.joint for c in chain} - {None} == (
        {c.joint for c in anchor_chain(robot, "left_wrist_yaw_link")} - {None}
    ) & set(robot.joint_names if known is None else known)
    assert apart(walk(chain, joints), by_mujoco(robot, qpos, "left_wrist_yaw_link")) < 1e-7


def test_the_root_is_no_way_off_and_a_body_that_is_not_there_is_refused(dancer):
    assert anchor_chain(dancer, dancer.body_names[0]) == ()
    with pytest.raises(RobotError, match="tail"):
        anchor_chain(dancer, "tail")


@pytest.mark.xfail(strict=True, reason="a chain link does not tell where on the body its joint's anchor is")
def test_a_joint_that_turns_about_another_point_than_the_bodys_origin_moves_the_anchor(dancer, rng):
    model = copy.copy(dancer.model)
    model.joint("waist_yaw").pos[:] = 0.05, 0.0, 0.0
    robot = dataclasses.replace(dancer, model=model)
    qpos, joints = somewhere(robot, rng)
    body = robot.profile.anchor
    assert apart(walk(anchor_chain(robot, body), joints), by_mujoco(robot, qpos, body)) < 1e-7
