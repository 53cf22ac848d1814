"""Pickles of three projects, read without running what they ask for."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from round_trip import gmr, same

from clips import ClipError, ReadOptions, clip_stem, read_clip
from robot_models import load_robot
from robot_models.maths import rotation as rot


def test_gmr_pickle(tmp_path, motion):
    (tmp_path / "m.pkl").write_bytes(pickle.dumps(gmr(motion)))
    same(read_clip(tmp_path / "m.pkl"), motion)


@pytest.mark.parametrize("compress", [0, ("zlib", 3), ("gzip", 3), ("bz2", 3), ("xz", 3)])
def test_phc_pickle_through_joblib(tmp_path, motion, compress):
    import joblib

    robot = load_robot("g1")
    kept = [i for i, j in enumerate(robot.joint_names) if "wrist" not in j]
    content = {"clip": {"root_trans_offset": motion[:, :3], "root_rot": rot.to_quat_xyzw(motion[:, 3:7]),
                        "dof": motion[:, 7:][:, kept], "fps": 30}}  # fmt: skip
    joblib.dump(content, tmp_path / "m.pkl", compress=compress)
    clip = read_clip(tmp_path / "m.pkl")
    assert len(clip.joint_names) == 23
    assert any("wrist" in f.value and "default pose" in f.what for f in clip.source.findings)
    same(clip, motion)


def test_one_of_several_clips_is_asked_for_by_name_or_number(tmp_path, motion):
    """As archives of a whole collection are kept; every layout may stand in one."""
    other = motion.copy()
    other[:, 0] += 0.5
    path = tmp_path / "all.pkl"
    path.write_bytes(pickle.dumps({"a/walk": gmr(motion), "b dance": gmr(other)}))
    same(read_clip(Path(f"{path}#a/walk")), motion)
    for asked in ("2", "b dance"):
        same(read_clip(Path(f"{path}#{asked}")), other)
        same(read_clip(path, ReadOptions(person=asked)), other)
    with pytest.raises(ClipError, match=r"2 clips \(a/walk, b dance\).*FILE#1") as refusal:
        read_clip(path)
    assert (refusal.value.option, refusal.value.suggestion) == ("person", "1")
    with pytest.raises(ClipError, match="no clip '3' among 2"):
        read_clip(Path(f"{path}#3"))
    with pytest.raises(ClipError, match="one of the two"):
        read_clip(Path(f"{path}#2"), ReadOptions(person="1"))
    assert clip_stem(Path(f"{path}#a/walk")) == "all_a_walk" and clip_stem(path) == "all"


def test_mimickit_pickle(tmp_path, motion):
    frames = np.concatenate((motion[:, :3], rot.log(motion[:, 3:7]), motion[:, 7:]), axis=1)
    (tmp_path / "m.pkl").write_bytes(pickle.dumps({"loop_mode": 0, "fps": 30, "frames": frames.tolist()}))
    same(read_clip(tmp_path / "m.pkl"), motion)


class Evil:
    def __reduce__(self):
        import os

        return os.system, ("touch /tmp/this_must_not_exist",)


@pytest.mark.parametrize("writer", ["pickle", "joblib", "object array"])
def test_a_pickle_that_wants_to_run_code_is_refused_before_it_runs(tmp_path, writer):
    import joblib

    path = tmp_path / "evil.pkl"
    if writer == "pickle":
        path.write_bytes(pickle.dumps({"root_pos": Evil()}))
    elif writer == "joblib":
        joblib.dump({"clip": {"dof": Evil()}}, path, compress=3)
    else:
        joblib.dump({"clip": {"dof": np.array([Evil()], dtype=object)}}, path)
    with pytest.raises(ClipError, match="wants to call|Python objects"):
        read_clip(path)


@pytest.mark.parametrize("fps", ["fast", [], None])
def test_a_pickle_with_a_broken_rate_is_refused(tmp_path, motion, fps):
    (tmp_path / "m.pkl").write_bytes(pickle.dumps(gmr(motion) | {"fps": fps}))
    with pytest.raises(ClipError, match="fps|frame rate"):
        read_clip(tmp_path / "m.pkl")


def test_a_joblib_of_tensors_is_read_without_torch_being_asked(tmp_path, motion):
    """PHC's own files: torch's tensors in joblib's pickle, compressed too."""
    import joblib

    torch = pytest.importorskip("torch")
    content = {"clip": {"root_trans_offset": torch.tensor(motion[:, :3]), "root_rot": rot.to_quat_xyzw(motion[:, 3:7]),
                        "dof": torch.tensor(motion[:, 7:]), "fps": 30}}  # fmt: skip
    for compress in (0, 3):
        joblib.dump(content, tmp_path / "phc.pkl", compress=compress)
        same(read_clip(tmp_path / "phc.pkl"), motion)
