"""Physics in the solve: the same as the judge's by another road, right derivatives, and motions that become possible."""

import dataclasses

import numpy as np
import pytest
from conftest import SAMPLES
from standing import standing

from clips import FREE, GLIDING, HumanClip, cut, read_clip
from retarget import RetargetConfig, dynamics_of, retarget
from retarget.config import PhysicsConfig, WholeClipConfig
from retarget.dynamics import momentum_rate
from retarget.dynamics.inverse_dynamics import differences, inverse_dynamics
from retarget.solver.floor_wrench import FloorWrench
from retarget.solver.physics_rows import WRENCH, PhysicsRows
from robot_models import integrate, kinematics
from robot_models.maths import BandedSystem

PLAIN = PhysicsConfig(weight=1.0, most=1e6)


@pytest.fixture(scope="module")
def hurried(dancer):
    """Two seconds of the sample dance at twice its speed, as it comes without physics: a tenth of it cannot be."""
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 6.0, 10.0)
    config = RetargetConfig(
        lead_in_s=0.0, lead_out_s=0.0, whole_clip=WholeClipConfig(physics=PhysicsConfig(weight=0.0))
    )
    return retarget(dataclasses.replace(clip, fps=2 * clip.fps), dancer, config)


def floor_of(robot, reference, config=PLAIN):
    qpos = np.array(reference.qpos)
    still = np.zeros(len(qpos), dtype=bool)
    return FloorWrench(robot, reference.contact, still, qpos, reference.fps, config), qpos


def test_what_a_motion_asks_for_is_what_pinocchios_inverse_dynamics_say(hurried, dancer):
    pytest.importorskip("pinocchio")
    qpos, dt = np.array(hurried.reference.qpos), 1.0 / hurried.reference.fps
    ours = momentum_rate(kinematics(dancer, qpos), qpos, dt).demand
    theirs = inverse_dynamics(dancer, qpos, *differences(qpos, dt))
    inner = slice(2, -2)
    assert ours.weight == pytest.approx(theirs.weight)
    np.testing.assert_allclose(ours.com_w, theirs.com_w, atol=1e-10)
    # Both are right to second order of a frame: what they differ by is a small part of what is asked.
    for mine, other in (
        (ours.force_w, theirs.force_w), (ours.moment_w, theirs.moment_w), (ours.torque, theirs.torque),
    ):  # fmt: skip
        assert np.abs(mine - other)[inner].max() < 0.02 * np.abs(other).max()


def test_scores_are_the_judges(hurried, dancer):
    pytest.importorskip("pinocchio")
    floor, qpos = floor_of(dancer, hurried.reference)
    floor.beyond(np.arange(len(qpos)), kinematics(dancer, qpos), qpos)
    judged = dynamics_of(hurried.reference, dancer).score
    assert (judged > 1.0).sum() > 3  # there is something to see
    np.testing.assert_allclose(floor.score[2:-2], judged[2:-2], atol=0.1, rtol=0.02)


def test_rows_have_the_derivatives_of_small_steps(hurried, dancer, rng):
    floor, qpos = floor_of(dancer, hurried.reference)
    frames = np.arange(len(qpos))
    step = np.cumsum(rng.normal(size=(len(qpos), qpos.shape[1] - 1)), axis=0)
    step = 1e-6 * (step - step.mean(axis=0))
    rows = floor.rows(frames, kinematics(dancer, qpos), qpos)
    moved = integrate(qpos, step)
    other = floor.rows(frames, kinematics(dancer, moved), moved)
    both, here, there = np.intersect1d(rows.frames, other.frames, return_indices=True)
    true = other._residual[there, :WRENCH] - rows._residual[here, :WRENCH]
    told = (rows._after(step) - rows._residual)[here, :WRENCH]
    assert len(both) > 20
    off = np.linalg.norm(true - told, axis=1) / np.linalg.norm(true, axis=1)
    assert np.median(off) < 0.03 and np.percentile(off, 80) < 0.15


def test_a_motion_that_lacks_nothing_has_no_rows(dancer):
    qpos = standing(dancer, 12)
    floor = FloorWrench(dancer, np.ones((12, 4), dtype=int), np.zeros(12, dtype=bool), qpos, 50.0, PLAIN)
    rows = floor.rows(np.arange(12), kinematics(dancer, qpos), qpos)
    blocks, gradient = np.tile(np.eye(dancer.model.nv), (12, 1, 1)), np.zeros((12, dancer.model.nv))
    rows.add_to(blocks, gradient)
    rows.couple(BandedSystem(blocks))
    floor.remember(np.arange(12), rows)
    assert not len(rows.frames) and not gradient.any() and not rows.squared(12).any() and not rows.update(gradient)


def rows_with(residual, by, outwards=None):
    out = np.zeros((len(residual), WRENCH)) if outwards is None else outwards
    joints = np.full((len(residual), residual.shape[1] - WRENCH), 3)
    return PhysicsRows(
        frames=1 + np.arange(len(residual)), residual=residual, by=by, outwards=out, joints=joints, config=PLAIN
    )


def test_rows_add_their_least_squares_problem_to_a_banded_system(rng):
    frames, nv = 7, 5
    residual, by = np.abs(rng.normal(size=(frames - 2, WRENCH + 2))), rng.normal(size=(3, frames - 2, WRENCH + 2, nv))
    rows = rows_with(residual, by)
    blocks, gradient = np.tile(np.eye(nv), (frames, 1, 1)), np.zeros((frames, nv))
    rows.add_to(blocks, gradient)
    system = BandedSystem(blocks)
    rows.couple(system)
    step = -system.solve(gradient)
    # The other road: one dense matrix.
    dense = np.zeros((residual.size, frames * nv))
    for f in range(frames - 2):
        for k in range(3):
            part = slice(f * residual.shape[1], (f + 1) * residual.shape[1])
            dense[part, (f + k) * nv : (f + k + 1) * nv] = by[k, f]
    expected = -np.linalg.solve(np.eye(frames * nv) + dense.T @ dense, dense.T @ residual.ravel())
    np.testing.assert_allclose(step.ravel(), expected, atol=1e-10)


def test_a_row_that_a_step_satisfies_leaves_and_comes_back_where_it_would_not():
    residual = np.zeros((1, WRENCH + 1))
    residual[0, 0], residual[0, WRENCH] = 1.0, 0.5
    by = np.zeros((3, 1, WRENCH + 1, 2))
    by[1, 0, 0, 0], by[1, 0, WRENCH, 1] = 1.0, 1.0
    rows = rows_with(residual, by, outwards=np.eye(1, WRENCH))
    step = np.zeros((3, 2))
    step[1] = -2.0, 0.0
    assert rows.update(step) == 1 and not rows.holds_wrench[0] and rows.holds_joint[0, 0]
    step[1] = 0.0, -1.0
    assert rows.update(step) == 1 and rows.holds_wrench[0] and not rows.holds_joint[0, 0]


def test_what_is_far_beyond_counts_in_proportion():
    def cost(size):
        residual = np.zeros((1, WRENCH + 1))
        residual[0, 0] = size
        config = dataclasses.replace(PLAIN, most=2.0)
        rows = PhysicsRows(
            frames=np.array([1]), residual=residual, by=np.zeros((3, 1, WRENCH + 1, 2)), outwards=np.eye(1, WRENCH),
            joints=np.full((1, 1), -1), config=config,
        )  # fmt: skip
        return rows.squared(3)[1]

    assert cost(2.0) == pytest.approx(4.0) and cost(20.0) == pytest.approx(40.0)


def test_a_hurried_dance_becomes_possible_and_stays_the_same_dance(hurried, dancer):
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 6.0, 10.0)
    solved = retarget(
        dataclasses.replace(clip, fps=2 * clip.fps), dancer, RetargetConfig(lead_in_s=0.0, lead_out_s=0.0)
    )
    before, after = (r.dynamics.score[3:-3] for r in (hurried, solved))
    assert (before >= 1.0).mean() > 0.05  # the control
    assert (after >= 1.0).mean() < 0.25 * (before >= 1.0).mean() and after.mean() < 0.3 * before.mean()
    turned = np.abs(solved.reference.joint_pos - hurried.reference.joint_pos)
    arms_and_legs = [
        "wrist" not in name for name in dancer.joint_names
    ]  # hands are turned anew from where the forearms are
    assert turned[:, arms_and_legs].mean() < 0.02 and solved.report.passed


def slid(speed, lift=0.0):
    """The first pose of the sample dance, carried over the floor for two seconds."""
    base = read_clip(SAMPLES / "groove.bvh")
    still = np.repeat(base.positions[:1], 120, axis=0)
    still[..., 0] += speed * np.arange(120)[:, None] / base.fps
    still[..., 2] += lift
    turns = np.repeat(base.orientations[:1], 120, axis=0)
    return dataclasses.replace(base, positions=still, orientations=turns)


def test_feet_that_slide_under_a_body_carry_it(dancer):
    result = retarget(slid(0.8), dancer)
    assert isinstance(result.source, HumanClip) and (result.contacts.labels == FREE).all()  # too fast for a touch
    dance = result.reference.contact[result.reference.dance]
    assert (dance == GLIDING).any(axis=1).mean() > 0.8
    assert not dynamics_of(result.reference, dancer).flight[result.reference.dance].any()


def test_a_jump_is_no_glide(dancer):
    base = read_clip(SAMPLES / "groove.bvh")
    t = (np.arange(150) - 60) / 60 / 0.4
    still = np.repeat(base.positions[:1], 150, axis=0)
    still[..., 2] += np.where((t > 0) & (t < 1), 4 * 0.2 * t * (1 - t), 0.0)[:, None]
    clip = dataclasses.replace(base, positions=still, orientations=np.repeat(base.orientations[:1], 150, axis=0))
    result = retarget(clip, dancer)
    in_air = (result.reference.contact == FREE).all(axis=1)
    assert in_air.sum() > 15 and not (result.reference.contact == GLIDING).any()
