"""Clips as types: landmarks lead to the right columns, and what no clip can be is refused."""

from dataclasses import replace

import numpy as np
import pytest
from stick_person import LANDMARKS, NAMES, person, robot_clip, tagged

from clips import ClipError
from robot_models.maths import rotation as rot


def test_a_landmark_leads_to_its_own_point_by_name():
    positions = np.repeat(tagged(5, len(NAMES))[..., None], 3, axis=-1)
    clip = person(frames=5, positions=positions)
    crossed = replace(clip, landmarks=LANDMARKS | {"left_knee": "right_wrist"})
    for name in NAMES:
        np.testing.assert_array_equal(clip.point(name)[:, 0], 100 * NAMES.index(name) + np.arange(5))
        np.testing.assert_array_equal(clip.orientation(name), clip.orientations[:, NAMES.index(name)])
    np.testing.assert_array_equal(crossed.point("left_knee"), clip.point("right_wrist"))


@pytest.mark.parametrize(("landmark", "sides"), [("pelvis", "hip"), ("chest", "shoulder"), ("neck", "shoulder")])
def test_middles_stand_in_for_points_that_a_clip_lacks_and_only_then(landmark, sides):
    clip = person()
    without = replace(clip, landmarks={k: v for k, v in LANDMARKS.items() if k != landmark})
    middle = 0.5 * (clip.point(f"left_{sides}") + clip.point(f"right_{sides}"))
    np.testing.assert_allclose(without.point(landmark), middle, atol=1e-15)
    assert np.abs(clip.point(landmark) - middle).max() > 0.01  # the person's own point is elsewhere
    assert without.orientation(landmark) is None and clip.orientation(landmark) is not None


def test_what_has_no_stand_in_is_an_error_and_an_orientation_may_be_absent():
    headless = person(landmarks={k: v for k, v in LANDMARKS.items() if k != "head"}, orientations=None)
    with pytest.raises(KeyError, match="head"):
        headless.point("head")
    assert headless.orientation("left_knee") is None


@pytest.mark.parametrize("fps", [0.0, -30.0, float("nan"), float("inf")])
@pytest.mark.parametrize("made", [person, robot_clip])
def test_a_rate_that_is_none_is_refused(made, fps):
    with pytest.raises(ClipError, match="frames per second.*above 0"):
        replace(made(), fps=fps)


@pytest.mark.parametrize("made", [person, robot_clip])
def test_two_frames_have_no_acceleration_and_are_no_clip(made):
    assert made(frames=3).frames == 3
    with pytest.raises(ClipError, match=r"person\.x: found 2 frames"):
        made(frames=2)


@pytest.mark.parametrize("field", ["positions", "orientations"])
def test_the_first_frame_that_is_not_finite_is_named_for_a_person(field):
    clip = person()
    bad = getattr(clip, field).copy()
    bad[[11, 25], 4, 1] = np.inf
    with pytest.raises(ClipError, match=f"frame 11: found 2 frames of {field}"):
        replace(clip, **{field: bad})


@pytest.mark.parametrize("field", ["root_pos", "root_quat", "joint_pos"])
def test_the_first_frame_that_is_not_finite_is_named_for_a_robot(field):
    clip = robot_clip()
    bad = getattr(clip, field).copy()
    bad[7:] = np.nan
    with pytest.raises(ClipError, match=f"frame 7: found 13 frames of {field}"):
        replace(clip, **{field: bad})


def test_a_root_quaternion_of_another_length_is_refused_and_its_sign_is_free():
    clip = robot_clip()
    assert (replace(clip, root_quat=-clip.root_quat).root_quat == -clip.root_quat).all()
    with pytest.raises(ClipError, match="off unit length by 0.01"):
        replace(clip, root_quat=1.01 * clip.root_quat)


def test_names_are_unique_and_as_many_as_columns():
    with pytest.raises(ClipError, match="the name b twice"):
        robot_clip(names=("a", "b", "b"))
    with pytest.raises(ClipError, match="the name left_knee twice"):
        person(names=tuple("left_knee" if n == "right_toe" else n for n in NAMES))
    with pytest.raises(ClipError, match=r"joint_pos of shape \(20, 3\), expected \(20, 2\)"):
        replace(robot_clip(), joint_names=("a", "b"))


@pytest.mark.parametrize("landmark", ["left_hip", "right_wrist"])
def test_a_person_without_a_limbs_joint_is_refused_by_its_name(landmark):
    with pytest.raises(ClipError, match=f"no point for {landmark} among pelvis"):
        person(landmarks={k: v for k, v in LANDMARKS.items() if k != landmark})


def test_what_the_caller_does_later_to_the_arrays_is_not_seen():
    quat = rot.from_yaw(np.zeros(20))
    clip = robot_clip(root_quat=quat)
    quat[:] = 0.5
    np.testing.assert_array_equal(clip.root_quat, rot.from_yaw(np.zeros(20)))
