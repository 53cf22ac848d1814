"""Momentum against MuJoCo's mass matrix and Pinocchio's momentum, its derivatives against finite differences."""

import mujoco
import numpy as np
import pytest
from any_pose import awkward, posed, random_qpos

from robot_models import (
    integrate,
    kinematics,
    load_robot,
    momentum,
    moved,
    pinocchio_model,
    pinocchio_q,
    pinocchio_v,
    skew,
)
from robot_models.maths import rotation as rot


@pytest.fixture(params=["dancer", "g1", "awkward"])
def robot(request, tmp_path):
    return awkward(tmp_path) if request.param == "awkward" else load_robot(request.param)


def test_the_mass_matrix_of_joints_is_mujocos(robot, rng):
    q = random_qpos(robot, rng, 3)
    ours = momentum(kinematics(robot, q)).mass_matrix(np.arange(3))
    for t in range(3):
        theirs = np.zeros((robot.model.nv, robot.model.nv))
        mujoco.mj_fullM(robot.model, posed(robot, q[t]), theirs)
        np.testing.assert_allclose(ours[t, 6:, 6:], theirs[6:, 6:], atol=1e-11)
        np.testing.assert_allclose(ours[t, :3, :3], theirs[:3, :3], atol=1e-11)


def test_momentum_is_pinocchios(robot, rng):
    pin = pytest.importorskip("pinocchio")
    q, v = random_qpos(robot, rng, 3), rng.normal(size=(3, robot.model.nv))
    kin = kinematics(robot, q)
    of_pose = momentum(kin)
    ours = (of_pose.matrix @ v[..., None])[..., 0]
    np.testing.assert_allclose(of_pose.body_momenta(v).sum(axis=1), ours, atol=1e-10)
    model = pinocchio_model(robot)
    data = model.createData()
    mujocos = v.copy()  # its root turns in its own frame
    mujocos[:, 3:6] = rot.rotate(rot.conjugate(q[:, 3:7]), v[:, 3:6])
    for t in range(3):
        theirs = pin.computeCentroidalMomentum(model, data, pinocchio_q(q)[t], pinocchio_v(q, mujocos)[t])
        np.testing.assert_allclose(of_pose.com[t], data.com[0], atol=1e-12)
        about_origin = theirs.angular + np.cross(data.com[0], theirs.linear)
        np.testing.assert_allclose(ours[t], np.concatenate((about_origin, theirs.linear)), atol=1e-10)
        assert np.abs(ours[t, :3] - theirs.angular).max() > 1e-3  # negative control: the point that it is about matters


def test_its_derivative_by_the_pose_is_that_of_small_steps(robot, rng):
    q, v = random_qpos(robot, rng, 2), rng.normal(size=(2, robot.model.nv))
    turning = momentum(kinematics(robot, q)).turning(v)

    def at(step):
        return (momentum(kinematics(robot, integrate(q, step))).matrix @ v[..., None])[..., 0]

    for k in range(robot.model.nv):
        step = np.zeros_like(v)
        step[:, k] = 1e-6
        np.testing.assert_allclose(turning[:, :, k], (at(step) - at(-step)) / 2e-6, atol=1e-6)


def test_torques_against_gravity_change_as_small_steps_say(robot, rng):
    q = random_qpos(robot, rng, 2)

    def torques(step):
        kin = kinematics(robot, integrate(q, step))
        weights = 9.81 * momentum(kin).inertia[..., 5]  # wrench that holds each body
        return (kin.screws[:, 6:] * (moved(robot)[:-1, 6:].T @ weights)).sum(axis=2)

    told = momentum(kinematics(robot, q)).holding_torques(np.arange(2), 9.81)
    for k in range(robot.model.nv):
        step = np.zeros((2, robot.model.nv))
        step[:, k] = 1e-6
        np.testing.assert_allclose(told[:, :, k], (torques(step) - torques(-step)) / 2e-6, atol=1e-5)


def test_skew_is_the_cross_product(rng):
    a, b = rng.normal(size=(2, 5, 3))
    np.testing.assert_allclose((skew(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-14)
