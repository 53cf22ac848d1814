"""Placing is a group of turns and shifts; recentring undoes any of them."""

from dataclasses import replace

import numpy as np
import pytest
from stick_person import person, robot_clip

from clips import HumanClip
from clips.edit.align import placed, recentre
from robot_models.maths import rotation as rot


def leaning_robot():
    tilt = rot.from_euler(np.stack((0.4 + 0.03 * np.arange(20), 0.2 * np.ones(20), -0.3 * np.ones(20)), axis=1), "ZYX")
    place = np.stack((3 + 0.1 * np.arange(20), -2 * np.ones(20), 0.8 * np.ones(20)), axis=1)
    return robot_clip(root_quat=tilt, root_pos=place)


CLIPS = pytest.mark.parametrize("clip", [person(), leaning_robot()], ids=["person", "robot"])


def same(a, b, tolerance=1e-12):
    human = isinstance(a, HumanClip)
    np.testing.assert_allclose(*((c.positions if human else c.root_pos) for c in (a, b)), atol=tolerance)
    assert rot.angle_between(*((c.orientations if human else c.root_quat) for c in (a, b))).max() < 1e-7


def turned(angle, v):
    return np.array([v[0] * np.cos(angle) - v[1] * np.sin(angle), v[0] * np.sin(angle) + v[1] * np.cos(angle), v[2]])


@CLIPS
def test_two_placings_are_one(clip):
    a, b = np.array([1.0, 2.0, 0.3]), np.array([-0.5, 0.1, -0.2])
    twice = placed(placed(clip, 0.7, a, "a"), -1.9, b, "b")
    same(twice, placed(clip, 0.7 - 1.9, turned(-1.9, a) + b, "ab"))
    assert twice.source.conversions == ("a", "b")


@CLIPS
def test_a_placing_is_undone_by_its_inverse(clip):
    shift = np.array([1.0, 2.0, 0.3])
    there = placed(clip, 0.7, shift, "")
    same(placed(there, -0.7, -turned(-0.7, shift), ""), clip)
    with pytest.raises(AssertionError):  # negative control: the shift undone before the turn
        same(placed(there, -0.7, -shift, ""), clip)


@CLIPS
@pytest.mark.parametrize("angle", [0.3, 2.0, np.pi, -3.0])
def test_where_and_whither_a_clip_was_recorded_leaves_no_trace(clip, angle):
    elsewhere = placed(clip, angle, np.array([30.0, -7.0, 0.0]), "")
    same(recentre(elsewhere), recentre(clip), tolerance=1e-9)


@CLIPS
def test_what_is_recentred_stays(clip):
    once = recentre(clip)
    same(recentre(once), once)


def test_a_robot_begins_over_the_origin_facing_ahead_and_leans_as_before():
    clip = leaning_robot()
    moved = recentre(clip)
    np.testing.assert_allclose(moved.root_pos[0], [0.0, 0.0, 0.8], atol=1e-12)
    assert abs(rot.yaw(moved.root_quat[0])) < 1e-12
    up = [rot.rotate(rot.conjugate(c.root_quat), np.tile([0.0, 0.0, 1.0], (20, 1))) for c in (clip, moved)]
    np.testing.assert_allclose(*up, atol=1e-12)  # gravity as the robot feels it
    np.testing.assert_array_equal(moved.joint_pos, clip.joint_pos)


@CLIPS
def test_heights_and_relative_turns_are_kept(clip):
    moved = placed(clip, 1.1, np.array([1.0, 1.0, 0.0]), "")
    if isinstance(clip, HumanClip):
        np.testing.assert_array_equal(moved.positions[..., 2], clip.positions[..., 2])
    quat = "orientations" if isinstance(clip, HumanClip) else "root_quat"
    a, b = getattr(clip, quat), getattr(moved, quat)
    steps = [rot.multiply(rot.conjugate(q[:-1]), q[1:]) for q in (a, b)]  # in the body's own frame
    assert rot.angle_between(*steps).max() < 1e-7


def test_the_note_says_what_was_done():
    clip = placed(person(), np.radians(40.0), np.array([2.0, -1.0, 0.0]), "")
    note = recentre(clip).source.conversions[-1]
    x, y = clip.point("pelvis")[0, :2]
    assert f"moved by ({-x:.3f}, {-y:.3f}) m" in note and "turned by -40.0 deg" in note


def test_points_without_orientations_are_placed_too():
    clip = replace(person(), orientations=None)
    moved = placed(clip, 0.5, np.zeros(3), "")
    assert moved.orientations is None
    np.testing.assert_array_equal(moved.positions, placed(person(), 0.5, np.zeros(3), "").positions)
