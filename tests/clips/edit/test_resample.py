"""Resampling: orders of convergence, what is exact, what time reversal and cutting in two must not change."""

from dataclasses import replace

import numpy as np
import pytest
from stick_person import person, robot_clip, tagged

from clips import ClipError, cut
from clips.edit import resample
from clips.edit.resample import new_times, sample, sample_clip, sample_quat
from robot_models.maths import rotation as rot


def test_positions_converge_at_fourth_order_inside():
    errors = []
    for fps in (10, 20, 40, 80):
        t = np.arange(4 * fps + 1) / fps
        middle = np.arange(fps, 3 * fps) + 0.5  # a second away from the ends, where a natural spline is of second order
        errors.append(np.abs(sample(np.sin(3 * t), middle) - np.sin(3 * middle / fps)).max())
    ratios = np.divide(errors[:-1], errors[1:])
    np.testing.assert_allclose(ratios[1:], 16.0, rtol=0.1)


def test_a_straight_line_stays_one_to_the_ends_column_by_column(rng):
    x, times = tagged(30, 4), np.sort(rng.uniform(0, 29, 50))
    np.testing.assert_allclose(sample(x, times), 100 * np.arange(4) + times[:, None], atol=1e-9)


def test_a_steady_turn_stays_one_at_every_fraction(rng):
    spin, times = np.array([0.1, -0.2, 0.15]), np.sort(rng.uniform(0, 39, 60))
    q = rot.exp(np.arange(40)[:, None] * spin)
    assert rot.angle_between(sample_quat(q, times), rot.exp(times[:, None] * spin)).max() < 1e-7
    crossed = rot.to_quat_xyzw(q)  # negative control: scalar last, read as scalar first
    assert rot.angle_between(sample_quat(crossed, times), rot.exp(times[:, None] * spin)).max() > 0.1


def test_given_frames_are_kept(rng):
    x, q = rng.normal(size=(20, 3)), rot.normalise(rng.normal(size=(20, 2, 4)))
    np.testing.assert_allclose(sample(x, np.arange(20.0)), x, atol=1e-12)
    assert rot.angle_between(sample_quat(q, np.arange(20.0)), q).max() < 1e-7


def test_signs_of_quaternions_do_not_matter_and_come_out_continuous(rng):
    q = rot.exp(np.cumsum(rng.normal(scale=0.2, size=(30, 3)), axis=0))
    times = np.linspace(0, 29, 77)
    plain, flipped = sample_quat(q, times), sample_quat(q * rng.choice([-1.0, 1.0], size=(30, 1)), times)
    assert rot.angle_between(plain, flipped).max() < 1e-7
    assert (np.sum(flipped[1:] * flipped[:-1], axis=1) > 0).all()


def test_time_may_run_either_way(rng):
    x, q = rng.normal(size=(25, 2)), rot.normalise(rng.normal(size=(25, 4)))
    times = np.linspace(0.3, 23.9, 40)
    np.testing.assert_allclose(sample(x[::-1], 24 - times), sample(x, times), atol=1e-12)
    assert rot.angle_between(sample_quat(q[::-1], 24 - times), sample_quat(q, times)).max() < 1e-7


@pytest.mark.parametrize("frames", [3, 61, 100])
@pytest.mark.parametrize("fps_in", [29.97, 30.0, 120.0])
@pytest.mark.parametrize("fps_out", [7.3, 30.0, 50.0, 60.0, 240.0])
def test_sample_times_are_even_and_one_more_would_not_fit(frames, fps_in, fps_out):
    times, step = new_times(frames, fps_in, fps_out), fps_in / fps_out
    assert times[0] == 0.0 and times[-1] <= frames - 1 < times[-1] + step + 1e-6
    np.testing.assert_allclose(np.diff(times), step, atol=1e-6)


@pytest.mark.parametrize("made", [person, robot_clip])
def test_half_the_rate_is_every_second_frame(made):
    clip = made(frames=41, fps=60.0)
    half = resample(clip, 30.0)
    assert half.frames == 21 and half.fps == 30.0
    for name in ("positions",) if made is person else ("root_pos", "joint_pos"):
        np.testing.assert_allclose(getattr(half, name), getattr(clip, name)[::2], atol=1e-9)
    quat = "orientations" if made is person else "root_quat"
    assert rot.angle_between(getattr(half, quat), getattr(clip, quat)[::2]).max() < 1e-7


def test_every_joint_stays_in_its_column():
    clip = resample(robot_clip(frames=31, fps=30.0, names="abcde"), 75.0)
    frame = 30.0 / 75.0 * np.arange(clip.frames)
    np.testing.assert_allclose(clip.joint_pos, 100 * np.arange(5) + frame[:, None], atol=1e-9)
    np.testing.assert_allclose(clip.root_pos, 1e4 + 100 * np.arange(3) + frame[:, None], atol=1e-9)
    np.testing.assert_allclose(rot.yaw(clip.root_quat), 0.05 * frame, atol=1e-9)


def test_the_same_rate_is_the_same_clip_and_another_is_on_record():
    clip = person()
    assert resample(clip, clip.fps) is clip and resample(clip, clip.fps * (1 + 1e-12)) is clip
    assert resample(clip, 50.0).source.conversions == ("resampled 30 -> 50 fps (60 -> 99 frames)",)
    assert sample_clip(clip, np.arange(5.0), 30.0, "why").source.conversions == ("why",)


@pytest.mark.parametrize("made", [person, robot_clip])
def test_a_cut_of_a_cut_is_a_cut(made):
    clip = made(frames=61, fps=30.0)
    once, twice = cut(clip, 0.5, 1.2), cut(cut(clip, 0.2, 1.5), 0.3, 1.0)
    first = "positions" if made is person else "joint_pos"
    np.testing.assert_array_equal(getattr(once, first), getattr(twice, first))
    np.testing.assert_array_equal(getattr(once, first), getattr(clip, first)[15:37])


def test_a_cut_in_two_shares_one_frame_and_loses_none():
    clip = robot_clip(frames=61, fps=30.0)
    a, b = cut(clip, 0.0, 1.0), cut(clip, 1.0, None)
    np.testing.assert_array_equal(np.concatenate((a.joint_pos, b.joint_pos[1:])), clip.joint_pos)


def test_a_cut_beyond_the_end_ends_there_and_the_whole_is_itself():
    clip = replace(person(frames=31), orientations=None)
    assert cut(clip, 0.0, None) is clip and cut(clip, 0.0, 99.0) is clip
    late = cut(clip, 0.5, 99.0)
    assert late.frames == 16 and late.orientations is None and late.source.conversions == ("cut to frames [15, 31)",)


def test_a_cut_that_leaves_too_little_is_refused():
    with pytest.raises(ClipError, match="found 2 frames"):
        cut(person(), 0.5, 0.5 + 1 / 30)
