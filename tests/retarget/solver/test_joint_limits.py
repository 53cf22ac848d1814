"""Limits of position, speed and acceleration: where they bind, and the nearest motion within them by another solver."""

import numpy as np
import pytest

from retarget import WholeClipConfig
from retarget.solver.joint_limits import JointLimit, joint_limits, project
from robot_models.maths.banded import BandedSystem

ORDERS = (0, 1, 2)


def limit(order, frames, low, high):
    return JointLimit(order, np.array(low), np.array(high), np.zeros((frames - order, len(low)), dtype=np.int8))


def limits(frames, low=(-1.0, -0.6), high=(1.0, 0.8), speed=0.3, turn=0.15):
    n = len(low)
    return [
        limit(0, frames, low, high),
        limit(1, frames, [-speed] * n, [speed] * n),
        limit(2, frames, [-turn] * n, [turn] * n),
    ]


def wild(rng, frames=40):
    """A slow sway that leaves all limits for a moment; the second joint is the first one's mirror."""
    t = np.arange(frames)
    joints = 0.5 * np.sin(0.15 * t)
    joints[18:23] += rng.normal(scale=0.5, size=5)
    return np.stack((joints, -0.5 * joints), axis=1)


def test_a_motion_within_its_bounds_is_given_back_as_it_is(rng):
    joints = 0.01 * rng.normal(size=(20, 2))
    assert project(limits(20), joints, 5) is joints


def test_what_was_brought_inside_is_left_alone_the_second_time(rng):
    joints = wild(rng)
    assert any(b.violation(joints).any() for b in limits(40))  # the control
    once = project(limits(40), joints, 12)
    np.testing.assert_array_equal(project(limits(40), once, 12), once)


def test_no_motion_leaves_the_ranges_whatever_the_motors_cannot_do(rng):
    lame = limits(40, speed=0.05, turn=1e-4)
    led = project(lame, 3.0 * wild(rng), 40)
    assert lame[2].violation(led).any()  # the control: nothing that these motors can do was found
    assert not lame[0].violation(led).any()


def test_the_nearest_motion_is_the_one_that_another_solver_finds(rng):
    """A step, small and with small third differences, that keeps all rows: a quadratic program for daqp."""
    import daqp

    frames = 24
    joints = wild(rng, frames)[:, :1]
    both = limits(frames, low=(-1.0,), high=(1.0,))
    ours = project(both, joints, frames)  # every frame may move
    third = np.diff(np.eye(frames), 3, axis=0)
    rows = np.concatenate([np.diff(np.eye(frames), order, axis=0) for order in ORDERS])
    value = rows @ joints[:, 0]
    low, high = (np.concatenate([np.full(frames - b.order, v[0]) for b, v in zip(both, side, strict=True)])
                 for side in ([b.lower for b in both], [b.upper for b in both]))  # fmt: skip
    step, _, flag, _ = daqp.solve(
        np.eye(frames) + third.T @ third,
        np.zeros(frames),
        rows,
        high - value,
        low - value,
        np.zeros(len(rows), dtype=np.int32),
    )
    assert flag == 1 and np.abs(step).max() > 0.1
    # Held rows hang on springs: what they give way, forces of about 1 over 3e4.
    np.testing.assert_allclose(ours[:, 0] - joints[:, 0], step, atol=3e-4)


def test_the_way_inside_is_the_same_when_time_runs_backwards_and_when_left_is_right(rng):
    joints = wild(rng)
    out = project(limits(40), joints, 12)
    np.testing.assert_allclose(project(limits(40), joints[::-1].copy(), 12)[::-1], out, atol=1e-9)
    mirror = limits(40, low=(-1.0, -0.8), high=(1.0, 0.6))
    np.testing.assert_allclose(project(mirror, -joints, 12), -out, atol=1e-9)


@pytest.mark.parametrize("reach", [8, 12])
def test_only_frames_within_reach_of_a_broken_one_move(reach, rng):
    joints = wild(rng)
    broken = np.flatnonzero(np.any([b.touched(b.violation(joints)) for b in limits(40)], axis=0))
    changed = np.flatnonzero(np.abs(project(limits(40), joints, reach) - joints).max(axis=1) > 1e-7)  # 1e-10 seeps on
    assert broken[0] - reach <= changed[0] and changed[-1] <= broken[-1] + reach
    assert len(changed) > len(broken)


@pytest.mark.parametrize("order", ORDERS)
def test_a_frame_is_touched_by_the_rows_that_change_when_it_moves(order, rng):
    frames, one = 9, limit(order, 9, [-1.0], [1.0])
    rows = rng.random((frames - order, 1)) < 0.3
    moves = [np.diff(np.eye(frames)[:, [t]], order, axis=0)[rows].any() for t in range(frames)]
    np.testing.assert_array_equal(one.touched(rows), moves)


@pytest.mark.parametrize("order", ORDERS)
def test_rows_join_beyond_their_bound_and_leave_when_their_spring_is_slack(order):
    one = limit(order, 6, [-0.1], [0.2])
    inside = np.zeros((6, 1))
    beyond = inside + np.cumsum(np.eye(6)[:, [3]], axis=0)  # a step of 1, seen by one row of order 1 and two of order 2
    for _ in range(order):
        assert one.update(inside) == 0
    assert one.update(inside) == 0
    count = one.update(beyond)
    assert count == {0: 3, 1: 1, 2: 2}[order]
    assert one.update(beyond) == 0  # still taut
    assert one.update(inside) == count and one.update(inside) == 0


@pytest.mark.parametrize("order", ORDERS)
def test_held_rows_pull_as_springs_do(order, rng):
    """Their gradient is the slope of spring (row - bound)^2 / 2, and their curvature the same spring's."""
    frames, joints = 7, 3.0 * rng.normal(size=(7, 2))
    one = limit(order, frames, [-0.1, -0.2], [0.2, 0.1])
    assert one.update(joints) > 3

    def after(x):
        """How far every row is beyond the bound that it was beyond at first: the energy is half of its square."""
        first, value = np.diff(joints, order, axis=0), np.diff(x, order, axis=0)
        over = np.where(first > one.upper, value - one.upper, np.where(first < one.lower, value - one.lower, 0.0))
        return np.sum(np.square(over))

    gradient = np.zeros((frames, 5))  # three coordinates before the joints, which no bound is on
    one.add_to(BandedSystem(np.zeros((frames, 5, 5))), gradient, joints)
    assert not gradient[:, :3].any()
    slope = np.zeros((frames, 2))
    for place in np.ndindex(slope.shape):  # central differences of a quadratic: exact for any step
        step = np.zeros((frames, 2))
        step[place] = 1.0
        slope[place] = (after(joints + step) - after(joints - step)) / 4.0
    strength = gradient[:, 3:][np.abs(slope) > 1e-6] / slope[np.abs(slope) > 1e-6]
    np.testing.assert_allclose(strength, strength[0], rtol=1e-9)
    assert strength[0] > 1e4
    # A step against the pull, with the same springs as curvature, ends at the bounds: the spring settles them in one go.
    system = BandedSystem(1e-3 * np.eye(5)[None].repeat(frames, axis=0))
    one.add_to(system, np.zeros((frames, 5)), joints)
    assert after(joints - system.solve(gradient)[:, 3:]) < 1e-6 * after(joints)


@pytest.mark.parametrize("order", ORDERS)
def test_rows_across_a_gap_between_frames_bind_nothing_and_parts_give_back_what_they_hold(order):
    whole = limit(order, 12, [-0.1], [0.1])
    frames = np.array([0, 1, 2, 3, 8, 9, 10, 11])
    part = whole.part(frames)
    joints = np.zeros((8, 1))
    joints[4:] = 0.05 if order == 0 else 5.0  # a leap across the gap alone, which is none in time
    assert part.update(joints) == 0
    joints[6] = 5.0 + 1.0 * (order > 0)
    assert part.update(joints) > 0
    whole.take(part, frames)
    again = whole.part(frames)
    assert again.update(joints) == 0  # it remembers
    other = np.zeros((12, 1))
    other[frames] = joints
    assert limit(order, 12, [-0.1], [0.1]).part(frames).update(joints) > 0  # the control: one that does not


def test_whether_a_motion_breaks_a_limit_does_not_depend_on_the_frame_rate(dancer):
    """Speed and acceleration of a parabola are the same at 25 and at 100 frames per second."""
    config, j = WholeClipConfig(), 3
    for share, broken in ((0.97, False), (1.03, True)):
        verdicts = []
        for fps in (25.0, 50.0, 100.0):
            t = np.arange(round(0.2 * fps) + 1) / fps
            joints = np.tile(dancer.default_joint_pos, (len(t), 1))
            joints[:, j] += 0.5 * share * config.acceleration_share * dancer.acceleration[j] * t**2
            limits = joint_limits(dancer, len(t), fps, config)
            verdicts.append(bool(limits[2].violation(joints)[:, j].any()))
        assert verdicts == [broken] * 3


def test_bounds_of_a_robot_keep_their_margins_within_its_limits(dancer):
    config, fps = WholeClipConfig(), 50.0
    position, speed, turn = joint_limits(dancer, 5, fps, config)
    assert (dancer.lower < position.lower).all() and (position.upper < dancer.upper).all()
    np.testing.assert_allclose(speed.upper * fps / dancer.velocity, config.speed_share)
    np.testing.assert_allclose(turn.upper * fps**2 / dancer.acceleration, config.acceleration_share)
    np.testing.assert_array_equal(speed.lower, -speed.upper)


def test_clips_of_two_frames_have_only_the_rows_that_they_can(dancer):
    limits = joint_limits(dancer, 2, 50.0, WholeClipConfig())
    out = project(limits, np.full((2, len(dancer.joint_names)), 9.0), 5)
    # Held on springs of 1e6 against a pull of about 10.
    np.testing.assert_allclose(out, np.broadcast_to(limits[0].upper, out.shape), atol=1e-4)
