"""Dances that nobody danced: the same for a seed, of one person, on her feet, and a clip like any other."""

import numpy as np
import pytest
from conftest import SAMPLES

from clips import HumanClip, read_clip
from clips.samples import choreograph as script
from clips.samples.make_samples import ANKLE, JOINTS, NAMES, write_bvh


def danced(seed, seconds=12.0):
    dance = script.Dance(seconds, np.random.default_rng(seed))
    dance.choreograph()
    return dance, *script.pose(dance)


@pytest.mark.parametrize("seed", range(6))
def test_a_dancer_keeps_her_bones_and_stands_between_her_moves(seed):
    dance, positions, turns = danced(seed)
    assert np.isfinite(positions).all() and np.abs(np.linalg.norm(turns, axis=-1) - 1.0).max() < 1e-9
    for i, (_, parent, offset) in enumerate(JOINTS):
        if parent:
            bone = np.linalg.norm(positions[:, i] - positions[:, NAMES.index(parent)], axis=-1)
            np.testing.assert_allclose(bone, np.linalg.norm(offset), atol=1e-9)
    ankles = positions[:, [NAMES.index("LeftFoot"), NAMES.index("RightFoot")], 2]
    assert ankles.min() > ANKLE - 0.02
    assert ((ankles - ANKLE).min(axis=1)[dance.raised < 1e-6] < 0.03).mean() > 0.9  # one foot stands, but for hops
    speed = np.abs(np.diff(positions[:, 0], axis=0)).max() * script.FPS
    assert 0.1 < speed < 4.0


def test_a_seed_is_a_dance():
    one, same, other = (danced(seed)[1] for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert one.shape != other.shape or np.abs(one - other).max() > 0.1


def test_a_dance_is_read_as_any_other(tmp_path):
    _, positions, turns = danced(1)
    write_bvh(tmp_path / "dance.bvh", positions, turns)
    clip = read_clip(tmp_path / "dance.bvh")
    assert isinstance(clip, HumanClip) and clip.frames == len(positions)


def test_the_drill_that_is_shipped_is_the_one_that_is_written(tmp_path):
    """By its numbers, written with six digits; and it asks for what it says."""
    dance = script.drill()
    assert dance.lowered.max() > 0.25 and dance.raised.max() > 0.08  # a deep knee bend, and hops
    clip = read_clip(SAMPLES / "drill.bvh")
    positions, _ = script.pose(dance)
    hips = clip.point("pelvis")
    assert clip.frames == len(positions)
    np.testing.assert_allclose(hips[:, 2] - hips[0, 2], positions[:, 0, 2] - positions[0, 0, 2], atol=1e-3)
