"""The whole-clip solver: its linear algebra against dense matrices, its limits on motions that cannot be, its windows."""

import dataclasses

import numpy as np
import pytest
from conftest import SAMPLES

from clips import cut, read_clip
from retarget import ObjectiveWeights, RetargetConfig, WholeClipConfig, retarget
from retarget.solver.collision import Clearance, Proximity, low_soles
from retarget.solver.joint_limits import joint_limits, project
from retarget.solver.objective import make_objective
from retarget.solver.residuals import residual_rows
from robot_models.maths.banded import BandedSystem, band_memory, difference_transposed, dilate
from robot_models.rigid_body.jacobians import integrate, kinematics


def dense(blocks, terms):
    """The same quadratic form, written out: blocks on the diagonal, differences by their matrices."""
    frames, nv, _ = blocks.shape
    out = np.zeros((frames, nv, frames, nv))
    for t in range(frames):
        out[t, :, t] += blocks[t]
    for order, weight, first in terms:
        d = np.diff(np.eye(frames), order, axis=0)
        for j in range(weight.shape[1]):
            out[:, first + j, :, first + j] += d.T @ np.diag(weight[:, j]) @ d
    return out.reshape(frames * nv, frames * nv)


def test_the_banded_system_is_the_dense_one(rng):
    frames, nv = 9, 4
    root = rng.normal(size=(frames, nv, nv))
    blocks = root @ root.swapaxes(1, 2) + np.eye(nv)
    terms = [
        (order, rng.uniform(0.1, 2.0, (frames - order, n)), nv - n) for order, n in ((0, 2), (1, 3), (2, 4), (3, 4))
    ]
    system = BandedSystem(blocks, memory=np.full_like(band_memory(frames + 3, nv), np.nan))
    for order, weight, first in terms:
        system.add_differences(order, weight, first)
    b = rng.normal(size=(frames, nv))
    np.testing.assert_allclose(
        system.solve(b).reshape(-1), np.linalg.solve(dense(blocks, terms), b.reshape(-1)), rtol=1e-9
    )


def test_a_system_that_is_not_positive_definite_is_an_error():
    with pytest.raises(np.linalg.LinAlgError, match="frame 2"):
        BandedSystem(np.stack([np.eye(3), np.eye(3), -np.eye(3), np.eye(3)])).solve(np.ones((4, 3)))


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_spreading_back_is_the_transpose_of_the_difference(order, rng):
    x, y = rng.normal(size=(8, 2)), rng.normal(size=(8 - order, 2))
    assert np.sum(np.diff(x, order, axis=0) * y) == pytest.approx(np.sum(x * difference_transposed(y, order)))


def test_widened_masks_reach_both_ways():
    assert dilate(np.array([0, 0, 0, 1, 0, 0], dtype=bool), 2).tolist() == [False, True, True, True, True, True]


def test_a_wild_motion_is_brought_inside_all_limits_and_left_alone_elsewhere(dancer, rng):
    fps, config = 50.0, WholeClipConfig()
    joints = np.tile(dancer.default_joint_pos, (200, 1))
    joints[90:110] += rng.normal(scale=1.0, size=(20, len(dancer.joint_names)))
    limits = joint_limits(dancer, len(joints), fps, config)
    assert all(b.violation(joints).any() for b in limits)  # the control: it was broken
    out = project(limits, joints, 30)
    assert not any(b.violation(out).any() for b in limits)
    np.testing.assert_array_equal(out[:40], joints[:40])


def test_goal_rows_are_derivatives_of_the_residuals(groove, dancer):
    picked = groove.targets.at(np.arange(40, 44))
    objective = make_objective(dancer, picked, ObjectiveWeights(), np.zeros((4, len(dancer.joint_names))))
    qpos = groove.reference.qpos[groove.reference.dance][40:44]
    _, jacobian, body_rows = residual_rows(objective, kinematics(dancer, qpos))
    assert body_rows == 9 + 24 and jacobian.shape[1] == body_rows + 14
    for axis in (0, 2, 4, 7, 15, 25):
        small = np.zeros((4, dancer.model.nv))
        small[:, axis] = 1e-6
        plus, minus = (residual_rows(objective, kinematics(dancer, integrate(qpos, s)))[0] for s in (small, -small))
        # Gauss-Newton takes the log's derivative as one: exact at zero error, near enough at the errors left here.
        np.testing.assert_allclose((plus - minus) / 2e-6, jacobian[:, :, axis], atol=0.1)


def test_clearance_rows_part_bodies_that_overlap(dancer):
    qpos = np.array(dancer.default_qpos)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        qpos[7 + dancer.joint(f"{side}_hip_roll")] -= 0.35 * sign
    kin = kinematics(dancer, qpos[None])
    places = Proximity(dancer, 0.01)(qpos[None])
    bodies = places.where((places.first >= 0) & (places.second >= 0))
    assert bodies.gap.min() < -0.005
    clearance = Clearance(bodies, kin, np.full(len(bodies.gap), 0.006), np.full(len(bodies.gap), 100.0))
    blocks, gradient = np.eye(dancer.model.nv)[None], np.zeros((1, dancer.model.nv))
    clearance.add_to(blocks, gradient)
    after = Proximity(dancer, 0.01)(integrate(qpos[None], -BandedSystem(blocks).solve(gradient)))
    assert after.where((after.first >= 0) & (after.second >= 0)).gap.min(initial=1.0) > 0.5 * bodies.gap.min()


def test_low_soles_are_found(dancer):
    qpos = np.array(dancer.default_qpos)
    qpos[2] -= 0.02
    places = low_soles(dancer, kinematics(dancer, qpos[None]), 0.005)
    assert len(places.gap) == 8
    np.testing.assert_allclose(places.gap, -0.02, atol=2e-3)


def test_a_step_that_sinks_a_foot_which_nothing_held_is_told(dancer):
    qpos = np.tile(dancer.default_qpos, (2, 1))
    qpos[:, 2] += 0.003
    kin = kinematics(dancer, qpos)
    places = low_soles(dancer, kin, 0.01)
    clearance = Clearance(places, kin, np.zeros(len(places.gap)), np.ones(len(places.gap)))
    step = np.zeros((2, dancer.model.nv))
    step[:, 2] = -0.0035, -0.006  # half a millimetre under the floor, and three
    assert clearance.update(step) > 0
    assert set(clearance.missed) == {1}
    clearance.update(step)
    assert not len(clearance.missed)  # the places are held by now


def test_windows_give_the_motion_of_the_whole():
    from robot_models import load_robot

    robot, clip = load_robot("dancer"), cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 6.0)
    whole, parts = (
        retarget(clip, robot, RetargetConfig(whole_clip=WholeClipConfig(window_s=w, overlap_s=1.0, settled=0.003)))
        for w in (40.0, 3.0)
    )
    # Hanging arms turn freely about their length; the places agree.
    assert np.percentile(np.abs(parts.reference.joint_pos - whole.reference.joint_pos), 95) < 0.02
    assert np.percentile(np.abs(parts.reference.body_pos_w - whole.reference.body_pos_w), 99) < 0.03
    assert parts.report.passed


def test_limits_hold_where_the_source_is_too_fast(dancer):
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 4.0)
    hurried = dataclasses.replace(clip, fps=3.0 * clip.fps)
    result = retarget(hurried, dancer)
    assert np.isfinite(result.reference.joint_pos).all()
    shares = {m.key: m for m in result.report.metrics if m.key.startswith("joint") and m.limit is not None}
    assert len(shares) == 3 and all(m.passed for m in shares.values()), shares
    per_frame = retarget(hurried, dancer, RetargetConfig(solver="mink"))
    broken = {m.label for m in per_frame.report.failures}
    assert "joint acceleration, share of the motor's" in broken  # the control: the limit is not idle here


@pytest.mark.parametrize("solver", ["mink", "placo"])
def test_per_frame_solvers_keep_position_and_speed_limits(solver, dancer):
    if solver == "placo":
        pytest.importorskip("placo")
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 2.0)
    r = retarget(clip, dancer, RetargetConfig(solver=solver)).reference
    assert (r.joint_pos >= dancer.lower).all() and (r.joint_pos <= dancer.upper).all()
    assert (np.abs(np.diff(r.joint_pos, axis=0)) * r.fps <= dancer.velocity).all()
