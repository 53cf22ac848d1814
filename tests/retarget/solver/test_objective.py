"""What the solver pulls towards: a robot's own pose asks nothing, and every weight belongs to what touches."""

import dataclasses

import numpy as np
import pytest
from derivatives import random_poses
from own_motion import own_targets

from clips import FREE, PIVOTING, PLANTED
from retarget import ObjectiveWeights
from retarget.solver.free_joints import free_joints
from retarget.solver.objective import make_objective
from retarget.solver.residuals import residual_rows
from retarget.targets.feet import contact_share
from robot_models import load_robot
from robot_models.rigid_body.jacobians import kinematics

WEIGHTS = ObjectiveWeights()


@pytest.mark.parametrize("name", ["dancer", "g1"])
def test_a_robots_own_pose_asks_nothing_of_it_wherever_it_is(name, rng):
    robot = load_robot(name)
    qpos = random_poses(robot, rng, 4)
    objective = make_objective(robot, own_targets(robot, qpos), WEIGHTS, qpos[:, 7:])
    residual, _, _ = residual_rows(objective, kinematics(robot, qpos))
    np.testing.assert_allclose(residual, 0.0, atol=1e-10)  # rounding of metres times the heaviest weight, 410
    elsewhere, _, _ = residual_rows(objective, kinematics(robot, random_poses(robot, rng, 4)))
    assert np.abs(elsewhere).max() > 1.0


def test_touching_edges_are_held_as_planted_ones_and_those_in_the_air_let_go_smoothly(dancer, rng):
    contact = np.full((60, 4), PLANTED)
    contact[20:40, :2] = FREE  # the left foot swings
    targets = own_targets(dancer, random_poses(dancer, rng, 60), contact)
    objective = make_objective(dancer, targets, WEIGHTS, np.zeros((60, len(dancer.joint_names))))
    left = objective.edge_weight[:, 0, 2]
    np.testing.assert_array_equal(objective.edge_weight[contact == PLANTED], WEIGHTS.planted)
    assert left[20:40].min() == pytest.approx(WEIGHTS.swing)  # the swing is longer than the way down
    assert (np.diff(left[19:30]) <= 0.0).all() and (np.diff(left[29:41]) >= 0.0).all()
    np.testing.assert_allclose(left[19:41], left[19:41][::-1], atol=1e-12)  # let go as it is taken up
    assert objective.roll_weight[:20, 0] == pytest.approx(WEIGHTS.planted_roll)
    assert objective.roll_weight[:, 0].min() == pytest.approx(WEIGHTS.swing_roll)


def test_an_edge_that_turns_on_purpose_is_free_across_the_floor_but_not_over_it(dancer, rng):
    targets = own_targets(dancer, random_poses(dancer, rng, 3), [PIVOTING, PLANTED, PLANTED, PLANTED])
    objective = make_objective(dancer, targets, WEIGHTS, np.zeros((3, len(dancer.joint_names))))
    np.testing.assert_array_equal(
        objective.edge_weight[:, 0], np.tile([WEIGHTS.pivot, WEIGHTS.pivot, WEIGHTS.planted], (3, 1))
    )
    np.testing.assert_array_equal(objective.edge_weight[:, 1:], WEIGHTS.planted)


def test_a_foot_rolls_as_firmly_as_its_firmer_edge(dancer, rng):
    contact = [FREE, PLANTED, FREE, FREE]  # on the left toe
    targets = own_targets(dancer, random_poses(dancer, rng, 3), contact)
    roll = make_objective(dancer, targets, WEIGHTS, np.zeros((3, len(dancer.joint_names)))).roll_weight
    np.testing.assert_allclose(roll, np.tile([WEIGHTS.planted_roll, WEIGHTS.swing_roll], (3, 1)))


def test_pins_take_the_place_of_the_posture_where_there_are_any(dancer, rng):
    targets = own_targets(dancer, random_poses(dancer, rng, 5))
    posture = rng.normal(size=(5, len(dancer.joint_names)))
    pins = np.where(rng.random(posture.shape) < 0.2, 1.0 + rng.random(posture.shape), np.nan)
    plain, pin_angles = (make_objective(dancer, targets, WEIGHTS, posture, p) for p in (None, pins))
    where = np.isfinite(pins)
    np.testing.assert_array_equal(pin_angles.posture[where], pins[where])
    np.testing.assert_array_equal(pin_angles.posture[~where], posture[~where])
    np.testing.assert_array_equal(pin_angles.posture_weight[where], WEIGHTS.pin)
    np.testing.assert_array_equal(pin_angles.posture_weight[~where], plain.posture_weight[~where])
    free = free_joints(dancer)
    np.testing.assert_array_equal(plain.posture_weight[:, free], WEIGHTS.free_joint)
    np.testing.assert_array_equal(plain.posture_weight[:, ~free], WEIGHTS.posture)
    nothing = make_objective(dancer, targets, WEIGHTS, posture, np.full_like(posture, np.nan))
    np.testing.assert_array_equal(nothing.posture, posture)


def test_goals_at_some_frames_have_the_rows_that_all_have_there(dancer, rng):
    qpos = random_poses(dancer, rng, 8)
    objective = make_objective(dancer, own_targets(dancer, qpos[::-1].copy()), WEIGHTS, qpos[:, 7:])
    some = np.array([6, 1, 1, 3])
    whole, jacobian, _ = residual_rows(objective, kinematics(dancer, qpos))
    part, jacobian_part, _ = residual_rows(objective.at(some), kinematics(dancer, qpos[some]))
    # The same numbers; only sums over other shapes may round otherwise.
    np.testing.assert_allclose(part, whole[some], atol=1e-9)
    np.testing.assert_allclose(jacobian_part, jacobian[some], atol=1e-9)
    assert len(objective.at(some).posture_weight) == len(some)


def test_how_firmly_an_edge_is_held_does_not_depend_on_the_frame_rate(dancer, rng):
    shares = []
    for rate in (50.0, 200.0):
        frames = round(rate)
        contact = np.full((frames, 4), FREE)
        contact[: frames // 4] = PLANTED
        feet = own_targets(dancer, random_poses(dancer, rng, frames), contact).feet
        shares.append(
            np.interp(
                np.linspace(0.0, 0.9, 50), np.arange(frames) / rate, contact_share(feet.contact != FREE, rate)[:, 0]
            )
        )
    # The last touching frame is up to one frame earlier: one frame's change of a fall over 0.16 s, 15/8 of 0.02 / 0.16.
    np.testing.assert_allclose(shares[0], shares[1], atol=0.24)
    assert shares[0][0] == 1.0 and shares[0][-1] == 0.0
    never = dataclasses.replace(feet, contact=np.full_like(feet.contact, FREE))
    assert not contact_share(never.contact != FREE, 200.0).any()
