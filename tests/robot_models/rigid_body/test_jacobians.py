"""Screws and wrenches against MuJoCo's Jacobians and against finite differences, over all columns at random poses."""

import mujoco
import numpy as np
import pytest
from any_pose import awkward, posed, random_qpos

from robot_models import load_robot
from robot_models.maths import rotation as rot
from robot_models.rigid_body.jacobians import ancestors, forces, integrate, kinematics, moved


@pytest.fixture(params=["dancer", "g1", "awkward"])
def robot(request, tmp_path):
    return awkward(tmp_path) if request.param == "awkward" else load_robot(request.param)


def in_our_tangent(jacobian, quat):
    """MuJoCo's columns, whose root rotation is in the root's own frame, for a root rotation in the world's."""
    out = jacobian.copy()
    out[:, 3:6] = jacobian[:, 3:6] @ rot.to_matrix(quat).T
    return out


def mujocos(robot, data, body, point):
    """How a point of a body moves, and how the body turns, per unit of each coordinate."""
    line, turn = np.zeros((3, robot.model.nv)), np.zeros((3, robot.model.nv))
    mujoco.mj_jac(robot.model, data, line, turn, point, robot.body_ids[body])
    return line, turn


def test_every_body_and_column_is_mujocos_jacobian(robot, rng):
    q = random_qpos(robot, rng, 2)
    ours = kinematics(robot, q)
    bodies = np.repeat(np.arange(len(robot.body_names)), 3)
    points = ours.pos + rng.normal(size=ours.pos.shape)  # not the bodies' own origins
    line = ours.derivatives(bodies, forces(points).reshape(2, -1, 6))
    turn = ours.derivatives(bodies, np.tile(np.eye(3, 6), (2, len(robot.body_names), 1)))
    for t in range(2):
        data = posed(robot, q[t])
        theirs = [mujocos(robot, data, b, points[t, b]) for b in range(len(robot.body_names))]
        # Roundings of numbers of a few metres.
        np.testing.assert_allclose(
            line[t], in_our_tangent(np.concatenate([a for a, _ in theirs]), q[t, 3:7]), atol=1e-12
        )
        np.testing.assert_allclose(
            turn[t], in_our_tangent(np.concatenate([b for _, b in theirs]), q[t, 3:7]), atol=1e-12
        )


def test_a_root_rotation_read_in_the_bodys_frame_would_be_seen(dancer, rng):
    """Negative control of the test above: MuJoCo's columns as they are, are not ours."""
    q = random_qpos(dancer, rng, 1)
    ours, wrist = kinematics(dancer, q), dancer.landmark("left_wrist")
    line, _ = mujocos(dancer, posed(dancer, q[0]), wrist, ours.pos[0, wrist])
    off = ours.derivatives(np.repeat(wrist, 3), forces(ours.pos[:, wrist]))[0] - line
    assert np.abs(off[:, 3:6]).max() > 0.01
    np.testing.assert_allclose(np.delete(off, [3, 4, 5], axis=1), 0.0, atol=1e-12)


def test_points_go_where_the_derivatives_say_to_second_order(robot, rng):
    q, step = random_qpos(robot, rng, 1), rng.normal(size=(1, robot.model.nv))
    here = kinematics(robot, q)
    bodies = np.repeat(np.arange(len(robot.body_names)), 3)
    slope = (here.derivatives(bodies, forces(here.pos).reshape(1, -1, 6)) @ step[0]).reshape(here.pos.shape)
    misses = []
    for h in (1e-2, 5e-3, 2.5e-3):
        ahead, behind = (kinematics(robot, integrate(q, s * h * step)).pos for s in (1.0, -1.0))
        misses.append(np.abs((ahead - behind) / (2 * h) - slope).max())
    # Central differences: half the step, a quarter of the miss.
    assert misses[0] / misses[1] == pytest.approx(4.0, rel=0.05)
    assert misses[1] / misses[2] == pytest.approx(4.0, rel=0.05)


def test_a_unit_force_does_the_work_that_the_screw_of_any_motion_makes_at_its_point(rng):
    spin, drift, points = rng.normal(size=(3, 20, 3))
    screws = np.concatenate((spin, drift), axis=1)
    velocity = drift + np.cross(spin, points)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", forces(points), screws), velocity, atol=1e-14)


def test_a_step_is_mujocos_integration_with_the_spin_turned_into_the_body(dancer, rng):
    q, step = random_qpos(dancer, rng, 6), rng.normal(size=(6, dancer.model.nv))
    ours = integrate(q, step)
    for t in range(6):
        theirs, local = q[t].copy(), step[t].copy()
        local[3:6] = rot.rotate(rot.conjugate(q[t, 3:7]), step[t, 3:6])
        mujoco.mj_integratePos(dancer.model, theirs, local, 1.0)
        np.testing.assert_allclose(ours[t], theirs, atol=1e-14)
    wrong = q[0].copy()
    mujoco.mj_integratePos(dancer.model, wrong, step[0], 1.0)
    assert rot.angle_between(wrong[3:7], ours[0, 3:7]) > 0.1  # negative control: the spin left in the world


def test_a_step_and_its_opposite_cancel_and_no_step_changes_nothing(dancer, rng):
    q, step = random_qpos(dancer, rng, 6), rng.normal(size=(6, dancer.model.nv))
    np.testing.assert_allclose(integrate(integrate(q, step), -step), q, atol=1e-14)
    np.testing.assert_allclose(integrate(q, 0.0 * step), q, atol=1e-15)


def test_a_joint_carries_a_body_where_mujocos_column_is_not_nothing(robot, rng):
    carried, (q,) = ancestors(robot), random_qpos(robot, rng, 1)
    data = posed(robot, q)
    for body in range(len(robot.body_names)):
        _, turn = mujocos(robot, data, body, np.zeros(3))
        np.testing.assert_array_equal(carried[body], np.abs(turn[:, 6:]).max(axis=0) > 0.0)
    np.testing.assert_array_equal(moved(robot)[-1], 0.0)  # the world stays
    assert moved(robot)[:-1, :6].all()  # and the root takes everything along
