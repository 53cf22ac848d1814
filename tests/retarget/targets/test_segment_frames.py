"""Frames of pelvis, trunk and feet: they turn with the person, and a file's own conventions fall out."""

import dataclasses

import numpy as np
import pytest
from conftest import SAMPLES
from person import elsewhere, stepping

from clips import cut, read_clip
from retarget.targets.segment_frames import calibrate, foot_direction, foot_frames, trunk_frames
from robot_models.maths import rotation as rot


@pytest.fixture(scope="module", params=["bvh", "csv"])
def clip(request):
    """With orientations, and of points alone."""
    return cut(read_clip(SAMPLES / f"groove.{request.param}"), 0.0, 1.5)


def angles(a, b):
    return rot.angle_between(a, b).max()


def test_whoever_stands_upright_and_faces_x_has_frames_of_identity():
    clip = stepping()
    for frames in trunk_frames(clip):
        assert angles(frames, np.tile(rot.IDENTITY, (clip.frames, 1))) < 1e-7
    still = slice(0, 15)
    flat = np.zeros(clip.frames, dtype=bool)
    flat[still] = True
    for side in ("left", "right"):
        frames = foot_frames(clip, side, flat)
        assert angles(frames[still], np.tile(rot.IDENTITY, (15, 1))) < 1e-7


@pytest.mark.parametrize("turn", [0.5, 3.0])
def test_all_frames_turn_with_the_person(clip, turn):
    moved, q = elsewhere(clip, turn, (1.0, 2.0, 0.0)), rot.from_yaw(np.array([turn]))
    flat = np.ones(clip.frames, dtype=bool)
    pairs = [*zip(trunk_frames(clip), trunk_frames(moved), strict=True)]
    pairs += [(foot_frames(clip, s, flat), foot_frames(moved, s, flat)) for s in ("left", "right")]
    for here, there in pairs:
        assert angles(rot.multiply(q, here), there) < 1e-6


def test_the_axes_that_a_file_gives_its_joints_do_not_matter(rng):
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 1.5)
    odd = rot.normalise(rng.normal(size=(1, len(clip.names), 4)))  # each joint's own
    other = dataclasses.replace(clip, orientations=rot.multiply(clip.orientations, odd))
    flat = np.ones(clip.frames, dtype=bool)
    for here, there in zip(trunk_frames(clip), trunk_frames(other), strict=True):
        assert angles(here, there) < 1e-6
    for side in ("left", "right"):
        assert angles(foot_frames(clip, side, flat), foot_frames(other, side, flat)) < 1e-6


def test_a_constant_offset_is_taken_off_wherever_it_is_seen(rng):
    wanted = rot.normalise(np.cumsum(0.1 * rng.normal(size=(40, 4)), axis=0) + [1.0, 0.0, 0.0, 0.0])
    offset = rot.normalise(rng.normal(size=(1, 4)))
    recorded = rot.multiply(wanted, offset)
    assert angles(recorded, wanted) > 0.1  # the control
    where = rng.random(40) < 0.2
    for mask in (None, where, np.zeros(40, dtype=bool)):  # of nowhere, everywhere is meant
        assert angles(calibrate(recorded, wanted, where=mask), wanted) < 1e-6
    spoiled = wanted.copy()
    spoiled[~where] = rot.normalise(rng.normal(size=(int((~where).sum()), 4)))
    assert angles(calibrate(recorded, spoiled, where=where), wanted) < 1e-6  # only those frames are asked


def test_calibration_changes_no_motion_only_its_offset(rng):
    recorded, wanted = (rot.normalise(rng.normal(size=(30, 4))) for _ in range(2))
    recorded = rot.continuous(recorded)
    out = calibrate(recorded, wanted)
    offsets = rot.multiply(rot.conjugate(recorded), out)
    assert angles(offsets, np.broadcast_to(offsets[0], offsets.shape)) < 1e-6

    # No other offset is nearer: sums of squared sines of half angles, against small turns of this one.
    def off(q):
        return np.sum(np.sin(0.5 * rot.angle_between(q, wanted)) ** 2)

    for turn in np.concatenate((np.eye(3), -np.eye(3))):
        assert off(rot.multiply(out, rot.exp(0.05 * turn)[None])) > off(out)


def test_pelvis_and_trunk_are_as_upright_as_the_person_and_face_across_hips_and_shoulders():
    clip = cut(read_clip(SAMPLES / "groove.csv"), 0.0, 1.5)
    for frames, part in zip(trunk_frames(clip), ("hip", "shoulder"), strict=True):
        left = clip.point(f"left_{part}") - clip.point(f"right_{part}")
        y = rot.rotate(frames, np.tile([0.0, 1.0, 0.0], (clip.frames, 1)))
        np.testing.assert_allclose(y, rot.unit(left), atol=1e-9)
        up = clip.point("neck") - 0.5 * (clip.point("left_hip") + clip.point("right_hip"))
        x = rot.rotate(frames, np.tile([1.0, 0.0, 0.0], (clip.frames, 1)))
        np.testing.assert_allclose(np.sum(x * up, axis=1), 0.0, atol=1e-9)


def test_without_toes_a_foot_heads_where_the_pelvis_does():
    clip = elsewhere(stepping(), 0.8, (0.0, 0.0, 0.0))
    bare = dataclasses.replace(clip, landmarks={k: n for k, n in clip.landmarks.items() if "toe" not in k})
    for side in ("left", "right"):
        along = rot.unit(foot_direction(bare, side))
        np.testing.assert_allclose(along, np.tile([np.cos(0.8), np.sin(0.8), 0.0], (clip.frames, 1)), atol=1e-9)
    assert np.abs(rot.unit(foot_direction(clip, "left"))[0, 2]) > 0.1  # with toes it slopes down to them


def test_a_foot_that_never_stands_has_its_sole_where_most_people_have_it():
    """Known from the ankle, the toe and the shin alone, in any pose: as of the same foot that stands."""
    clip = stepping()
    flat = np.zeros(clip.frames, dtype=bool)
    for side in ("left", "right"):
        known = foot_frames(clip, side, ~flat)
        unknown = foot_frames(clip, side, flat)
        assert rot.angle_between(known, unknown).max() < np.radians(12.0)
        lying = dataclasses.replace(clip, positions=rot.rotate(rot.exp(np.array([0.0, 1.5, 0.0])), clip.positions))
        turned = rot.multiply(rot.exp(np.array([[0.0, 1.5, 0.0]])), unknown)
        assert rot.angle_between(foot_frames(lying, side, flat), turned).max() < 1e-6
