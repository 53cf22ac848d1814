"""Rest poses before and after a dance are cut away up to the jump; what a dancer does by herself stays."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import SAMPLES
from damage import read_shared

from clips import read_clip, repair
from clips.edit.false_ends import without_false_ends

HUMAN = [
    "bvh/lafan1_dance1_subject2.bvh", "bvh/bandai1_dance_short_normal_001.bvh", "npz/asap_smpl_apt_level1.npz",
    "amc/cmu_lambada.amc",
]  # fmt: skip
ROBOT = ["csv/g1moves/M_Move5.csv", "pkl/gmt_dance.pkl", "csv/lafan1_g1_dance2_subject1.csv"]


def read(shared, file):
    return repair(read_shared(shared, file, 2.0, 8.0))


def rest_pose(shared):
    """Directions from the pelvis of a person with all rotations zero: the frame that begins CMU's walk, by landmark [m]."""
    clip = read_clip(shared / "bvh/cmu_12_01_walk.bvh")
    return {k: clip.point(k)[0] - clip.point("pelvis")[0] for k in clip.landmarks}


def with_rest(clip, pose, count, *, at_the_end=False):
    """So many frames of the pose, where the clip begins or ends."""
    one = clip.positions[-1 if at_the_end else 0].copy()
    hips = clip.point("pelvis")[-1 if at_the_end else 0]
    for k, name in clip.landmarks.items():
        if k in pose:
            one[clip.names.index(name)] = hips + pose[k]
    held = np.repeat(one[None], count, axis=0)
    parts = (clip.positions, held) if at_the_end else (held, clip.positions)
    return replace(clip, positions=np.concatenate(parts), orientations=None)


@pytest.mark.parametrize("count", [1, 2, 7, 60, 400])
@pytest.mark.parametrize("file", HUMAN)
def test_a_rest_pose_before_a_dance_is_cut_up_to_the_jump(shared, file, count):
    dance = replace(read(shared, file), orientations=None)
    for at_the_end in (False, True):
        mended = repair(with_rest(dance, rest_pose(shared), count, at_the_end=at_the_end))
        np.testing.assert_array_equal(mended.positions, dance.positions)
        assert [r.count for r in mended.source.repairs[len(dance.source.repairs) :]] == [count]


@pytest.mark.parametrize("count", [1, 2, 12, 60])
@pytest.mark.parametrize("file", ROBOT)
def test_a_robot_that_begins_with_all_joints_at_zero_loses_that(shared, file, count):
    dance = read(shared, file)
    assert np.abs(dance.joint_pos[0]).max() > 0.3
    held = {
        "joint_pos": np.concatenate((np.zeros((count, dance.joint_pos.shape[1])), dance.joint_pos)),
        "root_pos": np.concatenate((np.repeat(dance.root_pos[:1], count, axis=0), dance.root_pos)),
        "root_quat": np.concatenate((np.repeat(dance.root_quat[:1], count, axis=0), dance.root_quat)),
    }
    mended = repair(replace(dance, **held))
    np.testing.assert_array_equal(mended.joint_pos, dance.joint_pos)


@pytest.mark.parametrize("degrees, cut_off", [(4.0, False), (40.0, True)])
def test_a_small_jolt_is_no_false_start(degrees, cut_off):
    """Both sides of the threshold: the forearm of the first frame turned by so much."""
    dance = read_clip(SAMPLES / "groove.bvh")
    at = [dance.names.index(dance.landmarks[f"left_{p}"]) for p in ("elbow", "wrist")]
    positions = dance.positions.copy()
    along = positions[0, at[1]] - positions[0, at[0]]
    sideways = np.cross(along, [0.0, 0.0, 1.0])
    sideways *= np.linalg.norm(along) / np.linalg.norm(sideways)
    turn = np.radians(degrees)
    positions[0, at[1]] = positions[0, at[0]] + np.cos(turn) * along + np.sin(turn) * sideways
    mended = repair(replace(dance, positions=positions))
    assert (mended.frames < dance.frames) == cut_off


def test_a_dancer_who_bursts_out_of_stillness_keeps_every_frame():
    """A strike from a pose that is held: fast, but no jump, for the next step is as fast."""
    dance = read_clip(SAMPLES / "groove.bvh")
    at = dance.names.index(dance.landmarks["left_wrist"])
    positions = np.repeat(dance.positions[:1], 90, axis=0)
    strike = 0.5 * (np.clip(np.arange(90) - 30.0, 0.0, 12.0) / 60.0) ** 2 * 40.0  # 40 m/s2, then held out
    positions[:, at, 0] += strike
    clip = replace(dance, positions=positions, orientations=None)
    assert without_false_ends(clip) is clip


def test_one_jump_in_a_short_clip_is_cut_once():
    dance = read_clip(SAMPLES / "groove.bvh")
    positions = np.repeat(dance.positions[:1], 40, axis=0)
    positions[20:] += [0.1, 0.0, 0.0]
    short = replace(dance, fps=120.0, positions=positions, orientations=None)
    assert without_false_ends(short).frames >= 20
