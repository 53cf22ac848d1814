"""One Gauss-Newton step: the model's slope is the cost's, its minimum a dense solver's, its smoothness that of the smoother."""

import numpy as np
import pytest
from derivatives import random_poses

from retarget import ObjectiveWeights, RetargetError
from retarget.solver.joint_limits import JointLimit
from retarget.solver.normal_equations import NormalEquations, constrained_step, normal_equations
from retarget.solver.objective import Objective
from robot_models.maths import rotation as rot
from robot_models.maths.banded import HALF_BANDWIDTH, band_memory, difference_transposed
from robot_models.maths.smoothing import smooth
from robot_models.rigid_body.jacobians import integrate

FPS = 50.0


def goals_with(posture, weight):
    """Goals of which the quadratic model needs the posture alone."""
    frames = len(posture)
    return Objective(
        weights=ObjectiveWeights(),
        pelvis_pos=np.zeros((frames, 3)), pelvis_quat=np.zeros((frames, 4)), torso_quat=np.zeros((frames, 4)),
        part_height=np.zeros((frames, 0)), part_weight=np.zeros((frames, 0)), part_body=np.zeros((frames, 0), dtype=int),
        part_place=np.zeros((frames, 0, 2)), part_place_weight=np.zeros((frames, 0)),
        limbs=np.zeros((frames, 8, 3)), edges=np.zeros((frames, 4, 3)), foot_quat=np.zeros((frames, 2, 4)),
        contact=np.zeros((frames, 4), dtype=int),
        airborne=np.zeros(frames, dtype=bool), posture=posture,
        edge_weight=np.zeros((frames, 4, 3)), roll_weight=np.zeros((frames, 2)),
        posture_weight=weight,
    )  # fmt: skip


@pytest.fixture
def model_and_cost(dancer, rng):
    """A model about random poses that share one orientation, and the cost that it stands for, as a function of a step."""
    frames, nv = 6, dancer.model.nv
    qpos = random_poses(dancer, rng, frames)
    qpos[:, 3:7] = qpos[0, 3:7]
    residual, jacobian = rng.normal(size=(frames, 50)), rng.normal(size=(frames, 50, nv))
    weight = rng.uniform(0.1, 1.0, (frames, nv - 6))
    posture, bandwidths = rng.normal(size=(frames, nv - 6)), rng.uniform(0.1, 0.2, nv)
    model = normal_equations(goals_with(posture, weight), qpos, residual, jacobian, 33, np.zeros(frames), bandwidths)

    def cost(step):
        new = integrate(qpos, step)
        turns = rot.log(rot.multiply(new[1:, 3:7], rot.conjugate(new[:-1, 3:7])))
        moves = np.concatenate((np.diff(new[:, :3], axis=0), turns, np.diff(new[:, 7:], axis=0)), axis=1)
        rows = residual + (jacobian @ step[..., None])[..., 0]
        return 0.5 * (
            np.sum(rows**2)
            + np.sum((weight * (new[:, 7:] - posture)) ** 2)
            + np.sum(model.smoothness * np.diff(moves, 2, axis=0) ** 2)
        )

    return model, cost


def test_the_models_slope_is_that_of_goals_posture_and_smoothness_in_every_coordinate(model_and_cost):
    model, cost = model_and_cost
    slope, h = np.zeros_like(model.gradient), 1e-4
    for place in np.ndindex(slope.shape):
        step = np.zeros_like(slope)
        step[place] = h
        slope[place] = (cost(step) - cost(-step)) / (2.0 * h)
    # Costs of 1e4 to 16 digits over the step, 1e-8, and the log's third derivative times its square, 1e-8 of 1e2.
    np.testing.assert_allclose(model.gradient, slope, atol=1e-5)
    assert np.abs(slope).min() > 1e-5  # none is idle


def test_the_models_curvature_is_the_costs_but_for_the_little_that_keeps_it_positive(model_and_cost, rng):
    model, cost = model_and_cost
    step = 1e-3 * rng.normal(size=model.gradient.shape)
    step[:, 3:6] = step[0, 3:6]  # where the root's turns differ the log bends, at second order
    second = cost(step) + cost(-step) - 2.0 * cost(0.0 * step)
    third = np.diff(step, 3, axis=0)
    given = np.einsum("ti,tij,tj->", step, model.blocks, step) + np.sum(model.smoothness * third**2)
    assert given - second == pytest.approx(1e-3 * np.sum(step**2), rel=0.05)  # differences of 1e4 to 16 digits
    assert given > 100.0 * abs(given - second)


def test_damping_adds_to_the_curvature_and_nothing_else(dancer, rng):
    frames, nv = 5, dancer.model.nv
    posture = np.zeros((frames, nv - 6))
    args = random_poses(dancer, rng, frames), rng.normal(size=(frames, 40)), rng.normal(size=(frames, 40, nv)), 33
    free, damped = (
        normal_equations(goals_with(posture, posture), *args, np.full(frames, d), np.full(nv, 0.1)) for d in (0.0, 0.5)
    )
    np.testing.assert_array_equal(free.gradient, damped.gradient)
    np.testing.assert_array_equal(free.smoothness, damped.smoothness)
    added = damped.blocks - free.blocks
    assert (np.einsum("tii->ti", added) > 0.0).all()
    np.testing.assert_allclose(added, np.einsum("tii->ti", added)[:, :, None] * np.eye(nv), atol=1e-10)


def test_from_rest_a_step_towards_data_is_the_smoother_of_that_bandwidth(dancer, rng):
    """Two ways to one curve: goals that weigh every coordinate alike, and `smooth` on the same data."""
    frames, nv, hz = 60, dancer.model.nv, 4.0
    data = np.cumsum(rng.normal(size=(frames, nv)), axis=0)
    jacobian = np.broadcast_to(30.0 * np.eye(nv), (frames, nv, nv)).copy()
    qpos, nothing = np.tile(dancer.zero_qpos, (frames, 1)), np.zeros((frames, nv - 6))
    model = normal_equations(
        goals_with(nothing, nothing), qpos, -30.0 * data, jacobian, nv, np.zeros(frames), np.full(nv, hz / FPS)
    )
    step = constrained_step(model, qpos[:, 7:], [], None, 1, band_memory(frames, nv))
    # The curvature that keeps the model positive is 1e-6 of the goals'.
    np.testing.assert_allclose(step, smooth(data, FPS, hz), atol=1e-4)
    assert np.abs(step - data).max() > 0.5


def small_model(rng, frames=12, nv=8):
    root = rng.normal(size=(frames, nv, nv))
    blocks = root @ root.swapaxes(1, 2) + np.eye(nv)
    return NormalEquations(
        blocks=blocks, smoothness=rng.uniform(0.5, 2.0, nv), gradient=5.0 * rng.normal(size=(frames, nv))
    )


def slope_after(model, step):
    """Of the model at the end of a step."""
    smooth_part = difference_transposed(model.smoothness * np.diff(step, HALF_BANDWIDTH, axis=0), HALF_BANDWIDTH)
    return model.gradient + np.einsum("tij,tj->ti", model.blocks, step) + smooth_part


def test_without_limits_the_model_has_no_slope_at_the_end_of_its_step(rng):
    model = small_model(rng)
    step = constrained_step(model, np.zeros((12, 2)), [], None, 3, band_memory(12, 8))
    np.testing.assert_allclose(slope_after(model, step), 0.0, atol=1e-9)


def test_within_limits_whatever_slope_is_left_pushes_against_a_bound(rng):
    """The conditions of Karush, Kuhn and Tucker: free joints have no slope, held ones lean on their bound."""
    model, joints = small_model(rng), np.zeros((12, 2))
    low, high = np.full(2, -0.4), np.full(2, 0.3)
    free = constrained_step(model, joints, [], None, 1, band_memory(12, 8))
    assert (free[:, 6:] > 0.5).any() and (free[:, 6:] < -0.5).any()  # the control
    limit = JointLimit(0, low, high, np.zeros((12, 2), dtype=np.int8))
    step = constrained_step(model, joints, [limit], None, 20, band_memory(12, 8))
    angles, slope = step[:, 6:], slope_after(model, step)
    assert (angles > low - 1e-4).all() and (angles < high + 1e-4).all()  # springs of 1e6 give way by 1e-6 of the force
    np.testing.assert_allclose(slope[:, :6], 0.0, atol=1e-7)
    above, below = angles > high - 1e-4, angles < low + 1e-4
    assert above.any() and below.any() and (~above & ~below).any()
    np.testing.assert_allclose(slope[:, 6:][~above & ~below], 0.0, atol=1e-7)
    assert (slope[:, 6:][above] < 0.0).all() and (slope[:, 6:][below] > 0.0).all()


def test_a_model_without_a_minimum_is_refused(rng):
    model = small_model(rng)
    model.blocks[4] = -np.eye(8) * 1e3
    with pytest.raises(RetargetError, match="whole-clip solver.*frame 4"):
        constrained_step(model, np.zeros((12, 2)), [], None, 3, band_memory(12, 8))
