"""Inverse dynamics of references: two engines, differences, cuts."""

import numpy as np
import pytest

pytest.importorskip("pinocchio", reason="no Pinocchio wheels on Windows")

from standing import free_model, mujoco_inverse, reference_of, standing

from retarget.dynamics.inverse_dynamics import differences, dynamics_of, inverse_dynamics
from retarget.errors import RetargetError
from robot_models import load_robot
from robot_models.maths import rotation as rot


@pytest.mark.parametrize("name", ["dancer", "g1", "jvrc1"])
def test_inverse_dynamics_agrees_with_mujoco_root_included(name, rng):
    if name == "jvrc1":
        pytest.importorskip("jvrc_description")
    robot = load_robot(name)
    model, frames, nv = free_model(robot), 6, robot.model.nv
    qpos = np.concatenate(
        (rng.normal(size=(frames, 3)), rot.normalise(rng.normal(size=(frames, 4))), rng.normal(size=(frames, nv - 6))),
        1,
    )
    qvel, qacc = rng.normal(size=(2, frames, nv)) * np.array([[[2.0]], [[20.0]]])
    demand = inverse_dynamics(robot, qpos, qvel, qacc)
    assert demand.weight == pytest.approx(model.body_mass.sum() * -model.opt.gravity[2], rel=1e-12)
    for t in range(frames):
        data, theirs = mujoco_inverse(model, qpos[t], qvel[t], qacc[t])
        root = robot.body_ids[0]
        np.testing.assert_allclose(demand.com_w[t], data.subtree_com[root], atol=1e-9)
        # MuJoCo's free joint: force in the world, moment in the body frame about the body's origin.
        moment = rot.rotate(qpos[t, 3:7], theirs[3:6]) + np.cross(qpos[t, :3] - demand.com_w[t], theirs[:3])
        small = 1e-9 * np.abs(theirs).max()
        np.testing.assert_allclose(demand.force_w[t], theirs[:3], atol=small)
        np.testing.assert_allclose(demand.moment_w[t], moment, atol=small)
        np.testing.assert_allclose(demand.torque[t], theirs[6:], atol=small)


def test_differences_are_of_second_order_in_the_body_frame():
    a, b = np.array([0.3, -1.1, 0.7]), np.array([-0.9, 0.4, 1.3])

    def errors(dt):
        t = 0.7 + dt * np.arange(-2, 3)[:, None]  # away from 0, where body and world frame are one
        quat = rot.multiply(rot.exp(t * a), rot.exp(t * b))
        qpos = np.concatenate((np.sin(1.0 + t * a), quat, np.cos(0.5 + t)), axis=1)
        qvel, qacc = differences(qpos, dt)
        a_b = rot.rotate(rot.conjugate(rot.exp(t * b)), np.broadcast_to(a, (5, 3)))  # a as the body sees it
        true_v = np.concatenate((a * np.cos(1.0 + t * a), a_b + b, -np.sin(0.5 + t)), axis=1)
        true_a = np.concatenate((-(a**2) * np.sin(1.0 + t * a), -np.cross(b, a_b), -np.cos(0.5 + t)), axis=1)
        ends = np.abs(qvel - true_v)[[0, -1]].max()
        return np.array([np.abs(qvel - true_v)[2].max(), np.abs(qacc - true_a)[2].max(), ends])

    # Halving the step quarters the error; a wrong frame or a missing term would leave it as it is.
    np.testing.assert_allclose(errors(0.02) / errors(0.01), 4.0, rtol=0.1)


def test_nothing_differentiates_across_a_cut(dancer):
    qpos = standing(dancer, 8)
    qpos[4:, 0] += 1.0
    qpos[4:, 7] += 0.3
    join = dynamics_of(reference_of(dancer, qpos), dancer)
    cut_ = dynamics_of(reference_of(dancer, qpos, segments=[[0, 4, 0], [4, 8, 0]]), dancer)
    assert join.score.max() > 10.0
    # A slightly other hip is still a stand: the force is the weight.
    np.testing.assert_allclose(cut_.net_wrench_w[:, :3], np.tile([0.0, 0.0, cut_.weight], (8, 1)), atol=1e-9)


def test_another_robots_reference_is_refused(dancer):
    with pytest.raises(RetargetError, match="g1"):
        dynamics_of(reference_of(dancer, standing(dancer)), load_robot("g1"))
