"""Poses that flash up for a frame or a few are led through; two motions that were joined are refused."""

from dataclasses import replace

import numpy as np
import pytest
from damage import read_shared, with_rest

from clips import ClipError, repair
from clips.checks import check_jumps
from clips.edit import cut

CLIPS = [
    "bvh/bandai1_dance_short_normal_001.bvh",
    "bvh/perfume_aachan.bvh",
    "amc/cmu_lambada.amc",
    "npz/asap_smpl_apt_level1.npz",
]


@pytest.fixture(scope="module", params=CLIPS)
def clip(request, shared):
    start = 0.0 if "npz" in request.param else 8.0
    return replace(cut(repair(read_shared(shared, request.param)), start, start + 7.0), orientations=None)


def interrupted(clip, count):
    """So many frames of a rest pose in the middle."""
    half = clip.frames // 2
    first = with_rest(replace(clip, positions=clip.positions[:half]), count, at_the_end=True)
    return replace(clip, positions=np.concatenate((first.positions, clip.positions[half:])))


@pytest.mark.parametrize("count", [1, 2])
def test_a_pose_that_flashes_up_is_led_through(clip, count):
    mended = repair(interrupted(clip, count))
    told = mended.source.repairs[-1]
    assert told.count == count and "flash" in told.what
    kept = np.delete(np.arange(mended.frames), np.arange(clip.frames // 2, clip.frames // 2 + count))
    np.testing.assert_array_equal(mended.positions[kept], clip.positions)
    assert check_jumps(mended).verdict == "holds"


@pytest.mark.parametrize("seconds", [0.25, 1.0])
def test_longer_ones_are_refused_with_both_times(clip, seconds):
    count = round(seconds * clip.fps)
    with pytest.raises(ClipError, match=r"jumps, of \d+ deg .*cut the clip there"):
        repair(interrupted(clip, count))


def test_a_sound_clip_has_no_jump(clip):
    assert check_jumps(clip).verdict == "holds" and repair(clip) is clip
