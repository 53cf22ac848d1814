"""Foot targets: one place and one heading per stance, nothing under the floor, the same wherever and whenever it is."""

import dataclasses

import numpy as np
import pytest
from person import ANKLE, backwards, elsewhere, person, standing_feet, stepping, toes_ahead

from clips import FREE, PIVOTING, PLANTED
from retarget import ContactConfig
from retarget.targets.contacts import find_contacts
from retarget.targets.feet import flat_height, foot_targets, interpolate_offsets, smoothstep
from robot_models import FEET, load_robot
from robot_models.maths import rotation as rot
from robot_models.maths.intervals import intervals_of

CONFIG = ContactConfig()


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


def targets(clip, robot, scale=0.9):
    return foot_targets(clip, find_contacts(clip, CONFIG), robot, scale)


def corners(feet, robot):
    """Of both soles, in the world: (T, 2, 4, 3)."""
    return np.stack(
        [feet.pos[:, None, k] + rot.rotate(feet.quat[:, None, k], robot.soles[s].corners[None]) for k, s in enumerate(FEET)],
        axis=1,
    )  # fmt: skip


def noisy(rng):
    """The steps with a centimetre of noise in the standing feet, as a camera gives it."""
    clip = stepping()
    return dataclasses.replace(clip, positions=clip.positions + 0.0015 * rng.normal(size=clip.positions.shape))


def test_the_blend_begins_and_ends_at_rest_and_is_the_same_from_both_ends():
    t = np.linspace(0.0, 1.0, 1001)
    s, h = smoothstep(t), t[1]
    np.testing.assert_allclose(s + s[::-1], 1.0, atol=1e-12)
    assert (np.diff(s) >= 0.0).all() and s[0] == 0.0 and s[-1] == 1.0
    speed, turn = np.gradient(s, h), np.gradient(np.gradient(s, h), h)
    assert speed[0] < 1e-4 and abs(turn[0]) < 0.1  # of the third order at the ends: h^2, and 60 h
    assert speed.max() == pytest.approx(15.0 / 8.0, rel=1e-4)  # what the leads' durations count on
    np.testing.assert_array_equal(smoothstep(np.array([-3.0, 7.0])), [0.0, 1.0])


def test_spreading_keeps_what_is_locked_adds_up_and_runs_backwards_with_time(rng):
    locked = np.zeros(200, dtype=bool)
    locked[20:40] = locked[60:70] = locked[150:170] = True  # a short swing and a long one
    a, b = rng.normal(size=(2, 200, 3))
    for difference in (a, b):
        np.testing.assert_array_equal(interpolate_offsets(difference, locked, 50.0)[locked], difference[locked])
    both = interpolate_offsets(2.0 * a - b, locked, 50.0)
    np.testing.assert_allclose(
        both, 2.0 * interpolate_offsets(a, locked, 50.0) - interpolate_offsets(b, locked, 50.0), atol=1e-12
    )
    np.testing.assert_allclose(
        interpolate_offsets(a[::-1], locked[::-1], 50.0)[::-1], interpolate_offsets(a, locked, 50.0), atol=1e-12
    )
    assert not interpolate_offsets(a, locked, 50.0)[110].any()  # half of a long swing away from either anchor


@pytest.mark.parametrize("gap", [10, 49])
def test_a_shift_that_is_the_same_on_both_sides_of_a_short_swing_is_kept_through_it(gap):
    locked = np.ones(gap + 20, dtype=bool)
    locked[10 : 10 + gap] = False
    shift = np.where(locked[:, None], [[0.3, -0.2]], 9.0)  # whatever stands in the swing is not asked
    np.testing.assert_allclose(
        interpolate_offsets(shift, locked, 50.0), np.broadcast_to([0.3, -0.2], shift.shape), atol=1e-12
    )


def test_a_flat_stance_is_one_pose_flat_on_the_floor_however_noisy_the_source(robot, rng):
    clip = noisy(rng)
    contacts = find_contacts(clip, CONFIG)
    feet = targets(clip, robot)
    still = 0
    for k in range(2):
        flat = contacts.in_contact[:, 2 * k : 2 * k + 2].all(axis=1) & ~contacts.pivoting[:, k]
        for a, b in intervals_of(flat):
            still += b - a
            assert np.ptp(feet.pos[a:b, k], axis=0).max() < 1e-12
            assert rot.angle_between(feet.quat[a:b, k], feet.quat[[a], k]).max() < 1e-7  # a cosine's rounding
            np.testing.assert_allclose(corners(feet, robot)[a:b, k, :, 2], 0.0, atol=1e-9)
    assert still > 60
    moved = np.ptp(clip.point("left_ankle")[:15], axis=0).max()
    assert moved > 1e-3  # the control: the source's does move


def test_no_corner_of_a_sole_is_ever_under_the_floor(robot, rng):
    clip = noisy(rng)
    sunk = dataclasses.replace(clip, positions=clip.positions - [0.0, 0.0, 0.02] * np.ones(clip.positions.shape))
    for source in (clip, sunk):
        assert corners(targets(source, robot), robot)[..., 2].min() > -1e-9


def test_a_foot_that_pivots_keeps_its_height_and_lies_flat_while_its_heading_follows(robot):
    clip = stepping()
    feet = targets(clip, robot)
    pivots = find_contacts(clip, CONFIG).pivoting[:, 1]
    assert pivots.sum() > 15
    np.testing.assert_allclose(corners(feet, robot)[pivots, 1, :, 2], 0.0, atol=1e-9)
    along = clip.point("right_toe") - clip.point("right_ankle")
    heading = np.arctan2(along[:, 1], along[:, 0])
    turned = rot.yaw(feet.quat[:, 1]) - heading
    # One offset for the whole clip, and that of the stances beside it, eased in.
    assert np.ptp(turned[pivots]) < 0.1 < 0.5 * np.ptp(heading[pivots])


@pytest.mark.parametrize(("turn", "shift"), [(2.0, (3.0, -1.0, 0.0)), (-0.7, (0.0, 10.0, 0.4))])
def test_feet_turn_and_move_with_the_source_and_stay_on_the_floor(robot, turn, shift):
    clip, scale = stepping(), 0.8
    here, there = targets(clip, robot, scale), targets(elsewhere(clip, turn, shift), robot, scale)
    q = rot.from_yaw(np.array(turn))
    way = scale * np.array([shift[0], shift[1], 0.0])  # the source's floor is wherever its feet stand
    np.testing.assert_allclose(there.pos, rot.rotate(q, here.pos) + way, atol=1e-9)
    assert rot.angle_between(rot.multiply(q[None, None], here.quat), there.quat).max() < 1e-7
    np.testing.assert_allclose(np.linalg.norm(here.shift, axis=2), np.linalg.norm(there.shift, axis=2), atol=1e-9)


def test_feet_run_backwards_with_time(robot):
    clip = stepping()
    here, back = targets(clip, robot), targets(backwards(clip), robot)
    np.testing.assert_allclose(back.pos[::-1], here.pos, atol=1e-9)
    assert rot.angle_between(back.quat[::-1], here.quat).max() < 1e-7


def test_a_person_twice_as_large_at_half_the_scale_has_the_same_feet(robot):
    """Touches are found in metres, so they are handed on."""
    clip = stepping()
    contacts = find_contacts(clip, CONFIG)
    large = dataclasses.replace(clip, positions=2.0 * clip.positions)
    here, there = (foot_targets(c, contacts, robot, s) for c, s in ((clip, 0.9), (large, 0.45)))
    np.testing.assert_allclose(here.pos, there.pos, atol=1e-9)
    np.testing.assert_allclose(here.shift, there.shift, atol=1e-9)


def test_poses_change_no_faster_than_the_source_and_its_locks_ask(robot, rng):
    """Anchors are spread over the swings: nothing jumps where a stance begins."""
    feet = targets(noisy(rng), robot)
    steps = np.linalg.norm(np.diff(feet.pos, axis=0), axis=2)
    assert steps.max() < 0.05  # the source's fastest is 1.5 m/s and 0.2 m of the robot's own height is eased in
    assert rot.angle_between(feet.quat[1:], feet.quat[:-1]).max() < 0.1
    assert np.abs(np.diff(steps, axis=0)).max() < 0.02


@pytest.mark.parametrize(("heel", "label"), [(True, "toe"), (False, "heel")])
def test_a_foot_on_one_edge_turns_about_that_edge(robot, heel, label):
    """On the toes the front edge of the sole stays where it was while the heel comes up, and the other way round."""
    frames = 80
    ankles, _ = standing_feet(frames)
    up = 0.5 * np.sin(np.pi * np.clip((np.arange(frames) - 20) / 40, 0.0, 1.0)) ** 2
    pitch = up if heel else -up
    toes = ankles + toes_ahead(np.zeros((frames, 2)))
    if heel:  # the left ankle turns about the toe, or the toe about the ankle
        arm = ankles[:, 0] - toes[:, 0]
        ankles[:, 0] = toes[:, 0] + rot.rotate(rot.exp(pitch[:, None] * [0.0, 1.0, 0.0]), arm)
    else:
        toes[:, 0] = ankles[:, 0] + rot.rotate(rot.exp(pitch[:, None] * [0.0, 1.0, 0.0]), toes[:, 0] - ankles[:, 0])
    clip = person(ankles, toes)
    contacts = find_contacts(clip, CONFIG)
    one = contacts.labels[:, 0 if heel else 1] == FREE
    assert one.sum() > 10 and (contacts.labels[:, 1 if heel else 0] == PLANTED).all()
    feet = foot_targets(clip, contacts, robot, 0.9)
    edge, sole = getattr(robot.soles["left"], label), robot.soles["left"]
    place = feet.pos[:, 0] + rot.rotate(feet.quat[:, 0], np.tile(edge, (frames, 1)))
    assert np.ptp(place, axis=0).max() < 1e-9
    other = feet.pos[:, 0] + rot.rotate(feet.quat[:, 0], np.tile(sole.heel if heel else sole.toe, (frames, 1)))
    assert other[one, 2].max() > 0.03 and other[:, 2].min() > -1e-9


def test_feet_that_never_touch_follow_the_source(robot):
    ankles, toes = standing_feet(60)
    way = np.arange(60)[:, None] / 50.0 * np.array([0.9, 0.3, 0.0])  # gliding
    clip = person(ankles + way[:, None], toes + way[:, None])
    contacts = find_contacts(clip, CONFIG)
    assert (contacts.labels == FREE).all()
    feet = foot_targets(clip, contacts, robot, 0.9)
    assert not feet.shift.any()
    np.testing.assert_allclose(
        np.diff(feet.pos[..., :2], axis=0), 0.9 * np.diff(ankles + way[:, None], axis=0)[..., :2]
    )


def test_the_floor_of_a_foot_is_where_it_stands_flat():
    clip = stepping()
    contacts = find_contacts(clip, CONFIG)
    assert flat_height(clip, contacts, 0) == pytest.approx(ANKLE, abs=2e-3)
    never = dataclasses.replace(contacts, in_contact=np.zeros_like(contacts.in_contact))
    assert flat_height(clip, never, 0) == pytest.approx(ANKLE, abs=2e-3)
    assert PIVOTING in contacts.labels


def test_moved_feet_remember_how_far(dancer, rng):
    feet = targets(stepping(), dancer)
    way = rng.normal(size=feet.shift.shape)
    there = feet.moved(way)
    np.testing.assert_allclose(
        there.pos - feet.pos, np.concatenate((way, np.zeros((*way.shape[:2], 1))), axis=2), atol=1e-12
    )
    np.testing.assert_allclose(there.shift - feet.shift, way, atol=1e-12)
    np.testing.assert_allclose(there.moved(-way).pos, feet.pos, atol=1e-12)
