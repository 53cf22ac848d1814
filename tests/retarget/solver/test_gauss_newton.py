"""Descent over all frames at once: it comes to the same motion from anywhere near, keeps limits, and leaves rest alone."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from own_motion import own_targets

from retarget import ObjectiveWeights, WholeClipConfig
from retarget.config import GridStage
from retarget.solver.gauss_newton import _share, refine
from retarget.solver.objective import make_objective
from retarget.solver.residuals import residual_rows
from robot_models.maths import rotation as rot
from robot_models.rigid_body.jacobians import integrate, kinematics

FPS, CONFIG = 50.0, WholeClipConfig(settled=1e-4)
FREE = GridStage(step_s=0.0, iterations=12, smooth_hz=3.0, clearance=False)


@pytest.fixture(scope="module")
def steps(dancer):
    """Twelve frames of a sway on bent knees as goals, and the default pose placed among them."""
    posture = np.tile(dancer.default_joint_pos, (12, 1))
    sway = np.concatenate((np.tile(dancer.default_qpos[:7], (12, 1)), posture), axis=1)
    phase = 0.15 * np.arange(12)[:, None] + np.arange(dancer.nq - 7)
    sway[:, 7:] += 0.2 * np.sin(phase) + np.array([0.3 * ("knee" in n) for n in dancer.joint_names])
    targets = own_targets(dancer, sway)
    objective = make_objective(dancer, targets, ObjectiveWeights(posture=1.0, free_joint=1.0), posture)
    return objective, np.concatenate((targets.pelvis_pos, targets.pelvis_quat, posture), axis=1)


@pytest.fixture(scope="module")
def settled(dancer, steps):
    return refine(dancer, *steps, FPS, FREE, CONFIG)


def apart(a, b):
    """Farthest joint, place and orientation of two motions [rad or m]."""
    turned = rot.angle_between(a[:, 3:7], b[:, 3:7]).max()
    return max(np.abs(a[:, :3] - b[:, :3]).max(), turned, np.abs(a[:, 7:] - b[:, 7:]).max())


def test_errors_of_the_goals_fall(dancer, steps, settled):
    objective, start = steps
    before, after = (np.square(residual_rows(objective, kinematics(dancer, q))[0]).sum() for q in (start, settled))
    assert after < 0.1 * before


def test_from_another_start_it_comes_to_the_same_motion_faster_and_faster(dancer, steps, rng):
    objective, start = steps
    other = integrate(start, np.broadcast_to(0.1 * rng.normal(size=dancer.model.nv), (12, dancer.model.nv)))
    gaps = [apart(start, other)]
    for count in (3, 6, 12):
        stage = dataclasses.replace(FREE, iterations=count)
        gaps.append(apart(*(refine(dancer, objective, q, FPS, stage, CONFIG) for q in (start, other))))
    assert gaps[0] > 0.15
    shrunk = [later / sooner for sooner, later in pairwise(gaps)]
    assert shrunk[0] < 0.1 and shrunk[1] < 0.1 * shrunk[0]  # goals that can be reached: better than linear
    assert gaps[-1] < 1e-9


def test_where_it_has_settled_it_stays(dancer, steps, settled):
    objective, _ = steps
    again = refine(dancer, objective, settled, FPS, dataclasses.replace(FREE, iterations=2), CONFIG)
    assert apart(again, settled) < 1e-7  # what an arccosine leaves of rounding


def test_goals_turned_and_shifted_are_followed_by_the_motion_turned_and_shifted(dancer, steps, settled):
    objective, start = steps
    turn, shift = rot.from_yaw(np.array(1.9)), np.array([4.0, -2.0, 0.0])

    def placed(q):
        return np.concatenate(
            (rot.rotate(turn, q[:, :3]) + shift, rot.multiply(turn[None], q[:, 3:7]), q[:, 7:]), axis=1
        )

    moved = dataclasses.replace(
        objective, pelvis_pos=rot.rotate(turn, objective.pelvis_pos) + shift, edges=rot.rotate(turn, objective.edges) + shift,
        limbs=rot.rotate(turn, objective.limbs),
        **{k: rot.multiply(turn, getattr(objective, k)) for k in ("pelvis_quat", "torso_quat", "foot_quat")},
    )  # fmt: skip
    there = refine(dancer, moved, placed(start), FPS, FREE, CONFIG)
    # Smoothness weighs each axis of the world by its own curvature, which turning mixes; no joint feels it by more.
    assert apart(there, placed(settled)) < 2e-3


def test_limits_hold_on_the_way_from_a_start_that_breaks_them(dancer, steps):
    objective, start = steps
    wild = start.copy()
    wild[4:7, 7:] += 1.5
    out = refine(dancer, objective, wild, FPS, dataclasses.replace(FREE, iterations=4), CONFIG)
    low, high = dancer.ranges(0.0)
    assert (out[:, 7:] >= low).all() and (out[:, 7:] <= high).all()
    assert (np.abs(np.diff(out[:, 7:], axis=0)) * FPS <= dancer.velocity).all()
    assert (np.abs(np.diff(out[:, 7:], 2, axis=0)) * FPS**2 <= dancer.acceleration).all()
    assert (np.abs(np.diff(wild[:, 7:], axis=0)) * FPS > dancer.velocity).any()  # the control


def test_soles_are_kept_out_of_the_floor_where_clearance_is_asked_for(dancer, steps):
    from robot_models import forward_kinematics, sole_corners

    objective, start = steps
    sunk = dataclasses.replace(
        objective, edges=objective.edges - [0.0, 0.0, 0.03], pelvis_pos=objective.pelvis_pos - [0.0, 0.0, 0.03],
        edge_weight=0.1 * objective.edge_weight,
    )  # fmt: skip
    low = [
        sole_corners(dancer, *forward_kinematics(dancer, refine(dancer, sunk, start, FPS, stage, CONFIG)))[..., 2].min()
        for stage in (FREE, dataclasses.replace(FREE, clearance=True))
    ]
    assert low[0] < -0.02  # the control
    assert low[1] > -0.003  # springs give way: a pull of 41 per metre against one of 1200, over 30 mm


def test_frames_that_rest_do_not_move_while_others_are_solved(dancer, steps, settled):
    """More iterations touch the frames that are off, and those around them, alone."""
    objective, start = steps
    stage = GridStage(step_s=0.0, iterations=0, more_iterations=3, smooth_hz=3.0, clearance=False)
    still = objective.at(np.zeros(60, dtype=int))
    calm = refine(dancer, still, np.repeat(start[:1], 60, axis=0), FPS, FREE, CONFIG)
    config = dataclasses.replace(CONFIG, settled=0.05)
    np.testing.assert_array_equal(refine(dancer, still, calm, FPS, stage, config), calm)  # nothing is off
    kicked = calm.copy()
    kicked[55, 7 + dancer.joint("left_hip_pitch")] += 0.1  # the foot misses its place by some centimetres
    out = refine(dancer, still, kicked, FPS, stage, config)
    np.testing.assert_array_equal(out[:25], calm[:25])
    assert apart(out[55:56], calm[55:56]) < 0.05


def test_no_frame_takes_more_of_its_step_than_its_neighbours_allow(rng):
    wanted, largest = rng.uniform(0.0, 2.0, 50), 0.3
    share = _share(wanted, largest)
    assert (share <= 1.0).all() and (share * wanted <= largest + 1e-12).all()
    for t in range(50):
        own = min(1.0, min(largest / w for w in wanted[max(0, t - 3) : t + 4]))
        assert share[t] == pytest.approx(own)
    np.testing.assert_array_equal(_share(np.full(5, 0.1), largest), 1.0)
