"""Contact forces: cones, the equation of motion, the solver, the support."""

import mujoco
import numpy as np
import pytest
from scipy.optimize import nnls

pytest.importorskip("pinocchio", reason="no Pinocchio wheels on Windows")

from standing import free_model, mujoco_inverse, reference_of, standing

from retarget.dynamics.contact_forces import friction_pyramid, nonnegative_ridge
from retarget.dynamics.feasibility import hardest_stretches
from retarget.dynamics.floor_points import floor_points
from retarget.dynamics.inverse_dynamics import differences, dynamics_of
from retarget.dynamics.support import outside_support
from robot_models import load_robot
from robot_models.maths import rotation as rot


def generalised(robot, data, points, t, forces):
    """J^T f of forces on the sole points, by MuJoCo's Jacobians."""
    out, jacobian = np.zeros(robot.model.nv), np.zeros((3, robot.model.nv))
    for k, force in enumerate(forces):
        body = robot.body_ids[points.body[t, k]]
        mujoco.mj_jac(robot.model, data, jacobian, None, points.pos_w[t, k], body)
        out += jacobian.T @ force
    return out


@pytest.fixture(scope="module")
def groove_like(groove):
    """(robot, reference, dynamics) of a real dance."""
    robot = load_robot("dancer")
    return robot, groove.reference, dynamics_of(groove.reference, robot)


def test_standing_needs_the_weight_and_gets_it(dancer):
    reference = reference_of(dancer, standing(dancer))
    d = dynamics_of(reference, dancer)
    np.testing.assert_allclose(d.net_wrench_w[:, :3], np.tile([0.0, 0.0, d.weight], (5, 1)), atol=1e-9 * d.weight)
    np.testing.assert_allclose(d.net_wrench_w[:, 3:], 0.0, atol=1e-9 * d.weight)
    # What choosing among forces costs: 1e-5 of a gate, and some.
    np.testing.assert_allclose(d.residual, 0.0, atol=1e-4 * d.weight * 0.25)
    np.testing.assert_allclose(d.zmp_w, d.com_w[:, :2], atol=1e-12)
    assert (d.zmp_outside == 0.0).all() and d.in_contact.all()
    assert d.score.max() < 0.1 and not hardest_stretches(d)
    model = free_model(dancer)
    data, theirs = mujoco_inverse(model, dancer.default_qpos, np.zeros(model.nv), np.zeros(model.nv))
    left = theirs - generalised(dancer, data, floor_points(reference, dancer), 0, d.force_w[0])
    np.testing.assert_allclose(d.joint_torque[0], left[6:], atol=1e-6 * np.abs(left[6:]).max())
    np.testing.assert_allclose(d.residual[0, :3], left[:3], atol=1e-6 * d.weight)


def test_forces_stay_in_the_friction_cone_and_on_touching_points(groove_like):
    robot, _, d = groove_like
    tangent = np.linalg.norm(d.force_w[..., :2], axis=-1)
    assert (tangent <= robot.profile.friction * d.force_w[..., 2] + 1e-9).all()
    assert (d.force_w[~d.in_contact] == 0.0).all()
    assert d.solve_error.max() < 1e-6


def test_torques_and_forces_of_a_dance_fulfil_the_equation_of_motion(groove_like):
    robot, reference, d = groove_like
    model = free_model(robot)
    qvel, qacc = differences(reference.qpos, 1.0 / reference.fps)
    points = floor_points(reference, robot)
    for t in range(1, reference.frames - 1, 17):
        data, theirs = mujoco_inverse(model, reference.qpos[t], qvel[t], qacc[t])
        left = theirs - generalised(robot, data, points, t, d.force_w[t])
        np.testing.assert_allclose(d.joint_torque[t], left[6:], atol=1e-8 * np.abs(theirs).max())
        np.testing.assert_allclose(d.residual[t, :3], left[:3], atol=1e-8 * np.abs(theirs).max())


def test_the_zmp_is_the_centre_of_pressure_where_the_feet_can_give_it(groove_like):
    robot, reference, d = groove_like
    given = d.score < 1e-3
    assert given.sum() > 100 and np.abs(d.net_wrench_w[given, :2]).max() > 0.05 * d.weight
    at, force = floor_points(reference, robot).pos_w, d.force_w
    moment = at[..., :2] * force[..., 2:] - at[..., 2:] * force[..., :2]
    pressure = moment.sum(axis=1) / force[..., 2].sum(axis=1, keepdims=True)
    # A thousandth of the weight that is missing, half a metre up, is half a millimetre on the floor.
    np.testing.assert_allclose(d.zmp_w[given], pressure[given], atol=5e-4)
    assert d.zmp_outside[given].max() < 1e-3  # of the points, half a millimetre over the floor, and friction


def test_nonnegative_ridge_agrees_with_lawson_and_hanson(rng):
    # Pyramids of eight points, some absent, against targets that they can give, cannot, and nearly can.
    frames, ridge = 3000, 1e-6
    points = rng.uniform([-0.2, -0.2, -0.8], [0.2, 0.2, -0.8], size=(frames, 8, 3))
    edges = friction_pyramid(rng.uniform(-3.0, 3.0, size=(frames, 8)), 0.8)
    edges = edges * (rng.random((frames, 8)) < 0.6)[..., None, None]
    arms = np.cross(np.broadcast_to(points[:, :, None], edges.shape), edges)
    matrix = np.concatenate((edges.reshape(frames, 32, 3) * 4.0, arms.reshape(frames, 32, 3) * 10.0), -1).swapaxes(1, 2)
    given = (matrix @ rng.exponential(size=(frames, 32, 1)))[..., 0]
    target = given * rng.choice([0.01, 0.1, 1.0], size=(frames, 1)) + rng.normal(size=(frames, 6)) * np.array(
        [[0.0], [0.1], [5.0]]
    ).repeat(frames // 3, 0)
    x, _, error = nonnegative_ridge(matrix, target, ridge)
    assert error.max() < 1e-6 and (x >= 0.0).all()  # a line search that misses cycles in some of the 3000
    for t in range(0, frames, 50):
        on = matrix[t].any(axis=0)  # with columns of nothing but rounding, SciPy's answer is only good to 1e-3
        stacked = np.vstack((matrix[t][:, on], np.sqrt(ridge) * np.eye(on.sum())))
        theirs, _ = nnls(stacked, np.append(target[t], np.zeros(on.sum())))
        np.testing.assert_allclose(matrix[t] @ x[t], matrix[t][:, on] @ theirs, atol=1e-7)
        np.testing.assert_allclose(x[t, on], theirs, atol=1e-6)
        assert not x[t, ~on].any()


def test_outside_support_agrees_with_a_polygon_by_hand():
    feet = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [5.0, 5.0]])
    in_contact = np.array([True, True, True, True, False])
    at = np.array([[0.5, 0.5], [0.9, 0.2], [1.5, 0.5], [2.0, 2.0], [0.3, -0.2], [np.nan, 0.0]])
    many = outside_support(at, np.repeat(feet[None], 6, 0), np.repeat(in_contact[None], 6, 0))
    np.testing.assert_allclose(many, [0.0, 0.0, 0.5, np.sqrt(2.0), 0.2, 0.0], atol=1e-12)
    # One point, a line, nothing.
    one, line, none = np.eye(5, dtype=bool)[0], np.array([1, 1, 0, 0, 0], dtype=bool), np.zeros(5, dtype=bool)
    three = outside_support(np.full((3, 2), 0.5), np.repeat(feet[None], 3, 0), np.stack((one, line, none)))
    np.testing.assert_allclose(three, [np.sqrt(0.5), 0.5, 0.0], atol=1e-12)


def test_the_answer_does_not_turn_with_the_world(groove_like):
    robot, reference, d = groove_like
    turn = rot.from_yaw(np.array(1.1))
    qpos = reference.qpos.copy()
    qpos[:, :3] = rot.rotate(turn, qpos[:, :3]) + np.array([3.0, -2.0, 0.0])
    qpos[:, 3:7] = rot.multiply(turn, qpos[:, 3:7])
    other = dynamics_of(reference_of(robot, qpos, label=reference.contact, fps=reference.fps), robot)
    np.testing.assert_allclose(other.score, d.score, atol=1e-5)
    np.testing.assert_allclose(other.force_w, rot.rotate(turn, d.force_w), atol=1e-3)
    np.testing.assert_allclose(other.zmp_outside, d.zmp_outside, atol=1e-6)


def test_a_point_carries_where_it_is_labelled_or_low_and_slow_and_one_frame_around(dancer):
    qpos = standing(dancer, 12)
    qpos[:, 2] += np.array([0, 0, 0, 0, 1, 2, 4, 6, 7, 8, 8, 8]) * 0.005  # [m]; 0.25 to 0.5 m/s on the way
    label = np.zeros((12, 4), dtype=int)
    label[5] = [1, 0, 2, 0]
    points = floor_points(reference_of(dancer, qpos, label=label), dancer)
    edges = points.in_contact[:, [0, 2, 4, 6]]  # left heel, left toe, right heel, right toe
    low = [True] * 4 + [True] + [False] * 7  # frame 4 is 5 mm high and as fast as 0.25 m/s; frame 5 beside it
    np.testing.assert_array_equal(edges[:, 1], np.array(low) | (np.arange(12) == 5))
    # The label at frame 5 (1 cm high) reaches frame 6 (2 cm); 3 cm is too high for any.
    np.testing.assert_array_equal(edges[:, 0], np.arange(12) <= 6)
    np.testing.assert_array_equal(edges[:, 2:], edges[:, :2])
    late = np.zeros((12, 4), dtype=int)
    late[9:] = 1
    assert not floor_points(reference_of(dancer, qpos, label=late), dancer).in_contact[9:].any()
