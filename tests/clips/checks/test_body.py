"""Bones that change, hips that face away, flights that do not fall: measured, and beyond reason refused."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import SAMPLES
from damage import exchanged, read_shared

from clips import ClipError, at_speed, read_clip, repair
from clips.checks import CHECKS, check_bones, check_facing, check_gravity, check_jumps

CLIPS = ["bvh/bandai1_dance_short_normal_001.bvh", "npz/asap_smpl_apt_level1.npz", "amc/cmu_lambada.amc"]


@pytest.fixture(scope="module", params=CLIPS)
def clip(request, shared):
    return repair(read_shared(shared, request.param))


@pytest.mark.parametrize("noise, verdict", [(0.002, "holds"), (0.02, "doubtful"), (0.25, "refused")])
def test_bones_that_change_by_so_much(clip, noise, verdict):
    """Noise of every point [m]: of markers, of video, of no body at all."""
    rng = np.random.default_rng(0)
    check = check_bones(replace(clip, positions=clip.positions + rng.normal(0.0, noise, clip.positions.shape)))
    assert check.verdict == verdict
    assert " to " in check.value and "worst at" in check.where


def test_points_of_no_body_are_refused_by_the_bone_and_the_time(clip):
    rng = np.random.default_rng(0)
    slow = np.cumsum(rng.normal(0.0, 0.02, clip.positions.shape), axis=0)  # every point wanders off by itself
    with pytest.raises(ClipError, match=r"(off its length|face|travel|slips).*at|in"):
        repair(replace(clip, positions=clip.positions + slow, orientations=None))


def test_hips_and_shoulders_that_face_away_are_counted(clip):
    half = slice(0, clip.frames // 5)
    turned = exchanged(clip, ("hip", "knee", "ankle"), half)
    assert check_facing(clip).verdict == "holds"
    assert check_facing(turned).verdict == "doubtful"


@pytest.mark.parametrize("factor, verdict", [(0.4, "doubtful"), (1.0, "holds"), (2.0, "doubtful")])
@pytest.mark.parametrize(
    "file", ["deepmimic/humanoid3d_jump.txt", "bvh/bandai1_dance_short_normal_001.bvh", "csv/g1moves/B_LongKarate.csv"]
)
def test_flights_at_a_wrong_rate_do_not_fall_as_they_should(shared, file, factor, verdict):
    check = check_gravity(at_speed(repair(read_shared(shared, file)), factor))
    assert check.verdict in (verdict, "cannot tell") and (factor != 1.0 or check.verdict == "holds")


def test_nobody_who_lies_or_sits_is_in_flight(shared):
    check = check_gravity(repair(read_shared(shared, "csv/lafan1_g1_fallAndGetUp2_subject2.csv")))
    assert check.verdict == "cannot tell"


def test_every_check_answers_for_the_samples():
    for sample in ("groove.bvh", "groove.csv"):
        clip = repair(read_clip(SAMPLES / sample))
        for question in CHECKS:
            check = question(clip)
            assert check.verdict in ("holds", "cannot tell") and check.what and check.value and check.limit


def test_a_bone_without_a_length_says_nothing(clip):
    positions = clip.positions.copy()
    for side in ("left", "right"):
        toe, ankle = (clip.names.index(clip.landmarks[f"{side}_{p}"]) for p in ("toe", "ankle"))
        positions[:, toe] = positions[:, ankle]
    assert check_bones(replace(clip, positions=positions)).verdict == "holds"


@pytest.mark.parametrize("frames", [3, 5, 9])
@pytest.mark.parametrize("fps", [1.0, 20.0, 2000.0])
def test_the_shortest_clips_are_asked_too(frames, fps):
    from stick_person import person

    for question in CHECKS:
        assert "nan" not in question(person(frames, fps)).value


def test_a_fast_gesture_at_a_low_rate_is_no_tear():
    from stick_person import NAMES, person

    clip = person(40, 10.0)
    raised = clip.positions.copy()
    turn = np.radians(120.0) * np.clip((np.arange(40) / 10.0 - 2.0) / 0.35, 0.0, 1.0)
    shoulder = raised[:, NAMES.index("left_shoulder")]
    for part, long in (("left_elbow", 0.28), ("left_wrist", 0.53)):
        way = np.stack((np.zeros(40), np.sin(turn), -np.cos(turn)), axis=1)
        raised[:, NAMES.index(part)] = shoulder + long * way
    assert check_jumps(replace(clip, positions=raised, orientations=None)).verdict != "refused"
