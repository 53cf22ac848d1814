"""SMPL poses on the mean skeleton: rigid bones, turns that reach what hangs from them, a second road through SciPy."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clips import ClipError, ReadOptions
from clips.provenance import RawFile
from clips.readers.smpl import _JOINTS, _pose, read
from robot_models.maths import rotation as rot

NAMES = [j[0] for j in _JOINTS]
PARENTS = [j[1] for j in _JOINTS]
RAW = RawFile(path=Path("poses.npz"), data=b"x")
FRAMES = 5


def tame(rng, values=66):
    """Poses of somebody who stands, y up in the model and z up in the file, and moves a little."""
    poses = rng.normal(scale=0.05, size=(FRAMES, values))
    poses[:, :3] = [np.pi / 2, 0.0, 0.0]
    poses[:, [3 * NAMES.index(f"{s}_knee") for s in ("left", "right")]] = 0.3
    return poses, np.tile([0.1, 0.2, 1.15], (FRAMES, 1))


def clip_of(poses, trans, options=None, **more):
    return read(
        RAW, {"poses": poses, "trans": trans, "mocap_framerate": np.array(30.0), **more}, options or ReadOptions()
    )


def test_every_joint_is_where_scipys_rotations_put_it(rng):
    turns, trans = rng.normal(scale=1.5, size=(FRAMES, 22, 3)), rng.normal(size=(FRAMES, 3))
    positions, orientations = _pose(rot.exp(turns), trans)
    for t in range(FRAMES):
        for k in range(22):
            chain = [k]
            while PARENTS[chain[0]] >= 0:
                chain.insert(0, PARENTS[chain[0]])
            at, turn = trans[t] + _JOINTS[0][2], Rotation.from_rotvec(turns[t, 0])
            for j in chain[1:]:
                at, turn = at + turn.apply(_JOINTS[j][2]), turn * Rotation.from_rotvec(turns[t, j])
            np.testing.assert_allclose(positions[t, k], at, atol=1e-12)
            np.testing.assert_allclose(rot.to_matrix(orientations[t, k]), turn.as_matrix(), atol=1e-12)


def test_both_sides_hang_alike_and_limbs_go_outwards():
    def other(name):
        return name.replace("left", "#").replace("right", "left").replace("#", "right")

    above = {n: NAMES[p] for n, p in zip(NAMES, PARENTS, strict=True) if p >= 0}
    assert all(above[other(n)] == other(p) for n, p in above.items())
    for limb in (("foot", "ankle", "knee", "hip"), ("wrist", "elbow", "shoulder", "collar")):
        assert all(above[f"left_{a}"] == f"left_{b}" for a, b in pairwise(limb))


def test_bones_are_rigid_and_both_sides_nearly_alike(rng):
    positions, _ = _pose(rot.exp(rng.normal(scale=1.5, size=(FRAMES, 22, 3))), np.zeros((FRAMES, 3)))
    bones = np.linalg.norm(positions[:, 1:] - positions[:, PARENTS[1:]], axis=-1)
    np.testing.assert_allclose(bones, np.broadcast_to(bones[0], bones.shape), atol=1e-12)
    length = dict(zip(NAMES[1:], bones[0], strict=True))
    for name in (n for n in NAMES if n.startswith("left_")):
        # The mean of real people is not quite even; a row of another joint would be out by far more.
        assert length[name] == pytest.approx(length[name.replace("left", "right")], abs=0.01), name


def test_a_turn_moves_what_hangs_from_its_joint_and_nothing_else(rng):
    turns = rng.normal(size=(1, 22, 3))
    for k in range(22):
        other = turns.copy()
        other[0, k] += [0.3, -0.2, 0.4]
        moved = np.abs(_pose(rot.exp(other), np.zeros((1, 3)))[0] - _pose(rot.exp(turns), np.zeros((1, 3)))[0])[0].max(
            axis=-1
        )
        for j in range(22):
            above = PARENTS[j]
            while above >= 0 and above != k:
                above = PARENTS[above]
            assert (moved[j] > 1e-6) == (above == k), (NAMES[k], NAMES[j])


def test_a_whole_turn_more_is_the_same_pose(rng):
    turns = rng.normal(size=(3, 22, 3))
    angle = np.linalg.norm(turns, axis=-1, keepdims=True)
    other = turns * (angle - 2 * np.pi) / angle
    np.testing.assert_allclose(
        _pose(rot.exp(turns), np.zeros((3, 3)))[0], _pose(rot.exp(other), np.zeros((3, 3)))[0], atol=1e-12
    )


@pytest.mark.parametrize(("values", "family"), [(66, "body"), (72, "SMPL"), (156, "SMPL-H"), (165, "SMPL-X")])
def test_fingers_and_faces_change_no_joint_of_the_body(rng, values, family):
    poses, trans = tame(rng)
    more = np.concatenate((poses, rng.normal(size=(FRAMES, values - 66))), axis=1)
    plain, clip = clip_of(poses, trans), clip_of(more, trans)
    np.testing.assert_array_equal(clip.positions, plain.positions)
    assert f"{family} poses, {values} values" in clip.source.dialect


def test_a_walk_is_the_translations(rng):
    poses, trans = tame(rng)
    poses = np.repeat(poses[:1], FRAMES, axis=0)
    walk = 0.1 * np.arange(FRAMES)[:, None] * [1.0, 0.0, 0.0]
    np.testing.assert_allclose(
        clip_of(poses, trans + walk).positions, clip_of(poses, trans).positions + walk[:, None], atol=1e-12
    )


def test_orientations_stand_at_their_own_joint(rng):
    poses, trans = tame(rng)
    clip = clip_of(poses, trans)
    k, parent = NAMES.index("left_wrist"), NAMES.index("left_elbow")
    local = rot.multiply(rot.conjugate(clip.orientations[:, parent]), clip.orientations[:, k])
    np.testing.assert_allclose(rot.log(local), poses[:, 3 * k : 3 * k + 3], atol=1e-9)


def test_the_stature_scales_the_mean_person_and_the_assumption_is_on_record(rng):
    poses, trans = tame(rng)
    plain, small = clip_of(poses, trans), clip_of(poses, trans, ReadOptions(stature=1.5))
    assert small.height == 1.5
    assert {f.what: f.confidence for f in plain.source.findings}["skeleton"] == "assumed"
    np.testing.assert_allclose(small.positions / plain.positions, 1.5 / plain.height, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p, t: (p[:, :63], t), r"shape \(5, 63\).*66, 72 \(SMPL\)"),
        (lambda p, t: (np.degrees(p), t), "axis-angle in radians"),
        (lambda p, t: (p, t[:-1]), r"with trans \(4, 3\)"),
        (lambda p, t: (p[:2], t[:2]), r"shape \(2, 66\)"),
        (lambda p, t: (p * np.nan, t), "axis-angle in radians"),
    ],
    ids=["width", "degrees", "trans", "short", "nan"],
)
def test_what_is_no_pose_is_refused(rng, change, said):
    with pytest.raises(ClipError, match=said):
        clip_of(*change(*tame(rng)))
