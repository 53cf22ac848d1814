"""Damage put into a sound clip: found, mended, counted; a sound clip stays as it is."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import SAMPLES
from damage import tilted

from clips import ClipError, read_clip, repair, save_reference
from clips.edit import left_out_at_start, resample
from robot_models.maths import rotation as rot


@pytest.fixture(scope="module")
def dance():
    """A sound recording of a person, 10 s."""
    return repair(read_clip(SAMPLES / "groove.bvh"))


@pytest.fixture(scope="module")
def robots_dance(groove, tmp_path_factory):
    """A sound recording of a robot."""
    path = tmp_path_factory.mktemp("robot") / "ours.npz"
    save_reference(groove.reference, path)
    return repair(read_clip(path))


def only_repair(clip):
    (repair,) = clip.source.repairs
    return repair


def damaged(clip, **fields):
    return replace(clip, source=replace(clip.source, repairs=()), **fields)


@pytest.mark.parametrize("sample", ["groove.bvh", "groove.csv"])
def test_a_sound_clip_is_given_back_as_it_is(sample):
    clip = read_clip(SAMPLES / sample)
    assert repair(clip) is clip


def test_a_sound_robot_clip_is_given_back_as_it_is(robots_dance):
    assert repair(robots_dance) is robots_dance


def test_a_false_start_is_left_out_and_counted(dance):
    away = dance.positions.copy()
    away[0] += [3.0, 0.0, 0.0]
    mended = repair(damaged(dance, positions=away))
    assert only_repair(mended).count == 1 and "hips jump" in only_repair(mended).what
    np.testing.assert_array_equal(mended.positions, dance.positions[1:])


def t_pose(dance):
    """The first frame with the arms stretched out sideways."""
    pose = dance.positions[0].copy()
    place = {k: dance.names.index(v) for k, v in dance.landmarks.items()}
    across = rot.unit((pose[place["left_shoulder"]] - pose[place["right_shoulder"]]) * [1.0, 1.0, 0.0])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for part, out in (("elbow", 0.28), ("wrist", 0.53)):
            pose[place[f"{side}_{part}"]] = pose[place[f"{side}_shoulder"]] + sign * out * across
    return pose


def test_a_calibration_pose_that_is_held_is_left_out(dance):
    held = np.repeat(t_pose(dance)[None], round(0.7 * dance.fps), axis=0)
    held = held + np.random.default_rng(0).normal(0.0, 0.001, held.shape)  # a marker's noise
    led = damaged(dance, positions=np.concatenate((held, dance.positions)), orientations=None)
    mended = repair(led)
    assert "T-pose" in only_repair(mended).what
    assert only_repair(mended).count == pytest.approx(len(held), abs=round(0.12 * dance.fps))
    assert left_out_at_start(mended) == only_repair(mended).count / dance.fps and left_out_at_start(dance) == 0.0
    assert repair(mended) is mended


def test_a_calibration_pose_in_mid_clip_is_refused_where_it_jumps(dance):
    held = np.repeat(t_pose(dance)[None], round(0.7 * dance.fps), axis=0)
    half = dance.frames // 2
    middle = np.concatenate((dance.positions[:half], held, dance.positions[half:]))
    with pytest.raises(ClipError, match=r"2 jumps, of \d+ deg .*cut the clip there"):
        repair(damaged(dance, positions=middle, orientations=None))


def test_repeated_frames_are_led_through(dance):
    fast = int(np.argmax(np.linalg.norm(np.diff(dance.point("left_wrist"), axis=0), axis=1)))
    stuck, turned = dance.positions.copy(), dance.orientations.copy()
    stuck[fast], turned[fast] = stuck[fast - 1], turned[fast - 1]
    mended = repair(damaged(dance, positions=stuck, orientations=turned))
    assert only_repair(mended).count == 1 and "repeated" in only_repair(mended).what
    assert np.abs(mended.positions - dance.positions).max() < 0.2 * np.abs(stuck - dance.positions).max()
    assert repair(mended) is mended


def test_a_pose_that_is_held_is_no_repeated_frame(dance):
    held = np.concatenate((dance.positions[:100], np.repeat(dance.positions[99:100], 60, axis=0)))
    clip = damaged(dance, positions=held, orientations=None)
    assert repair(clip) is clip


def test_a_point_that_flies_off_and_back_is_led_through(dance):
    spiked = dance.positions.copy()
    spiked[120:123, 7] += [0.0, 1.5, 1.0]
    mended = repair(damaged(dance, positions=spiked))
    assert (only_repair(mended).count, only_repair(mended).of) == (3, "samples")
    assert np.abs(mended.positions - dance.positions).max() < 0.02


def test_a_joint_that_flips_and_back_is_led_through(robots_dance):
    spiked = robots_dance.joint_pos.copy()
    spiked[200, 3] += 1.2
    mended = repair(damaged(robots_dance, joint_pos=spiked))
    assert only_repair(mended).count == 1
    assert np.abs(mended.joint_pos - robots_dance.joint_pos).max() < 0.03


def test_a_dance_torn_in_two_is_refused_with_the_time(dance):
    torn = dance.positions.copy()
    torn[300:] += [2.0, 0.0, 0.0]
    with pytest.raises(ClipError, match=rf"frame 300: found hips that jump .* between {299 / dance.fps:.2f} s and"):
        repair(damaged(dance, positions=torn))


def test_a_floor_that_drifts_and_leans_is_levelled(dance):
    video = resample(dance, 30.0)
    time = np.arange(video.frames) / video.fps
    positions = video.positions.copy()
    lift = 0.02 * time[:, None] + 0.08 * positions[..., 0]
    positions[..., 2] += lift
    mended = repair(damaged(video, positions=positions))
    assert "floor levelled" in only_repair(mended).what
    assert np.ptp((mended.positions - video.positions)[..., 2]) < 0.2 * np.ptp(lift)
    assert repair(mended) is mended
    # It is turned, not bent: distances are those that were recorded.
    a, b = (
        clip.point("left_ankle") - clip.point("right_shoulder")
        for clip in (damaged(video, positions=positions), mended)
    )
    np.testing.assert_allclose(np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1), atol=1e-9)


def test_a_floor_that_leans_like_a_roof_is_left_alone(dance):
    clip = tilted(dance, 50.0, 30.0)
    assert repair(clip) is clip


def test_strict_refuses_what_would_be_mended_and_names_it(dance):
    spiked = dance.positions.copy()
    spiked[120, 7] += 1.5
    with pytest.raises(ClipError, match=r"spikes led through: 1 samples, first at \d"):
        repair(damaged(dance, positions=spiked), strict=True)
    assert repair(dance, strict=True) is dance


def test_strict_refuses_what_was_mended_while_reading():
    clip = read_clip(SAMPLES / "groove.csv")
    with pytest.raises(ClipError, match="lost samples filled by interpolation: 3 samples"):
        repair(clip, strict=True)
