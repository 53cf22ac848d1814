"""A file that says one thing twice is held against itself: names against bodies, velocities against positions."""

import pickle

import numpy as np
import pytest
from damage import read_shared

from clips import ClipError, ReadOptions, full_qpos, read_clip, save_reference
from clips.identify import breadth_first
from clips.provenance import RawFile
from clips.readers.pickles import load
from robot_models import load_robot

GMR = ["pkl/gmt_dance.pkl", "pkl/twist2_yanjie_walk_001.pkl"]
ROBOTS_OWN = ["csv/g1moves/M_ShortMove12.csv", "csv/g1moves/B_HandsUp.csv", "csv/g1_gangnam_style_60hz.csv"]


def gmr_of(shared, file, **more):
    """A robot's clip as a GMR pickle, in MuJoCo's order, with more keys."""
    clip = read_shared(shared, file)
    quat = clip.root_quat[:, [1, 2, 3, 0]]
    return {"fps": clip.fps, "root_pos": clip.root_pos, "root_rot": quat, "dof_pos": clip.joint_pos} | more, clip


def saved(tmp_path, content):
    (tmp_path / "clip.pkl").write_bytes(pickle.dumps(content))
    return tmp_path / "clip.pkl"


@pytest.mark.parametrize("key", ["joint_names", "dof_names"])
@pytest.mark.parametrize("order", ["isaac", "sides", "reversed", "links", "as they stand"])
@pytest.mark.parametrize("file", ROBOTS_OWN)
def test_names_in_a_pickle_say_which_column_is_which(tmp_path, shared, file, order, key):
    robot = load_robot("g1")
    content, clip = gmr_of(shared, file)
    names = {
        "isaac": list(breadth_first(robot)),
        "sides": [n.replace("left", "#").replace("right", "left").replace("#", "right") for n in robot.joint_names],
        "reversed": list(robot.joint_names)[::-1],
        "as they stand": list(robot.joint_names),
        "links": list(robot.joint_names)[::-1],
    }[order]
    columns = [clip.joint_names.index(n) for n in names]
    if order == "links":
        names = [robot.body_names[1 + robot.joint(n)] for n in names]
    content |= {"dof_pos": clip.joint_pos[:, columns], key: names}
    read = read_clip(saved(tmp_path, content))
    np.testing.assert_allclose(full_qpos(read, robot)[:, 7:], full_qpos(clip, robot)[:, 7:], atol=1e-9)
    assert any((f.what, f.value) == ("joint order", "by name") for f in read.source.findings)


@pytest.mark.parametrize("names, said", [(28, "28 names for 29 columns"), (30, "30 names for 29 columns")])
def test_names_that_are_not_one_for_each_column_are_refused(tmp_path, shared, names, said):
    robot = load_robot("g1")
    content, _ = gmr_of(shared, ROBOTS_OWN[0], joint_names=[*robot.joint_names, "waist_extra_joint"][:names])
    with pytest.raises(ClipError, match=said):
        read_clip(saved(tmp_path, content))


@pytest.mark.parametrize("file", GMR)
@pytest.mark.parametrize("told", ["sides", "isaac", "one limb"])
def test_names_that_the_bodies_of_a_file_contradict_are_refused(tmp_path, shared, file, told):
    content = dict(load(RawFile.load(shared / file)))
    robot = load_robot("g1")
    columns = [n for n in robot.joint_names if content["dof_pos"].shape[1] == 29 or "wrist" not in n]
    swap = {"left_elbow_joint": "right_elbow_joint", "right_elbow_joint": "left_elbow_joint"}
    content["joint_names"] = {
        "sides": [n.replace("left", "#").replace("right", "left").replace("#", "right") for n in columns],
        "isaac": [n for n in breadth_first(robot) if n in columns],
        "one limb": [swap.get(n, n) for n in columns],
    }[told]
    with pytest.raises(ClipError, match="names in the order of the numbers") as refused:
        read_clip(saved(tmp_path, content))
    fits = {"sides": "left and right exchanged", "isaac": "MuJoCo's depth-first order", "one limb": "correct the names"}
    assert fits[told] in str(refused.value)


@pytest.mark.parametrize("file", GMR)
def test_true_names_and_bodies_agree_and_it_is_told(tmp_path, shared, file):
    clip = read_clip(shared / file)
    (held,) = [f for f in clip.source.findings if f.what == "joint names"]
    assert held.confidence == "measured"


def altered(path, tmp_path, **changes):
    with np.load(path, allow_pickle=False) as arrays:
        content = dict(arrays) | changes
    np.savez(tmp_path / "altered.npz", **content)
    return tmp_path / "altered.npz"


@pytest.mark.parametrize("file", ["ours", "npz/amp_G1_dance.npz"])
def test_archives_whose_names_are_exchanged_are_refused(tmp_path, shared, groove, file):
    path = shared / file
    if file == "ours":
        path = tmp_path / "ours.npz"
        save_reference(groove.reference, path)
    key = "joint_names" if file == "ours" else "dof_names"
    with np.load(path, allow_pickle=False) as arrays:
        names = [str(n) for n in arrays[key]]
    swapped = np.array([n.replace("left", "#").replace("right", "left").replace("#", "right") for n in names])
    read_clip(path)
    with pytest.raises(ClipError, match="names in the order of the numbers"):
        read_clip(altered(path, tmp_path, **{key: swapped}))


@pytest.mark.parametrize("factor", [0.4, 0.5, 1.5, 2.0, 7.0])
@pytest.mark.parametrize("file", ["npz/amp_G1_dance.npz", "npz/g1moves_tiktok.npz"])
def test_a_rate_that_its_velocities_contradict_is_refused_with_the_right_one(tmp_path, shared, file, factor):
    true = read_clip(shared / file).fps
    path = altered(shared / file, tmp_path, fps=np.array(true * factor))
    with pytest.raises(ClipError, match="joint velocities") as refused:
        read_clip(path)
    assert refused.value.option == "fps" and float(refused.value.suggestion) == pytest.approx(true, rel=0.05)
    assert read_clip(path, ReadOptions(fps=true)).fps == true


def test_velocities_of_a_rounded_rate_are_no_contradiction(tmp_path, shared):
    true = read_clip(shared / "npz/amp_G1_dance.npz").fps
    assert read_clip(altered(shared / "npz/amp_G1_dance.npz", tmp_path, fps=np.array(1.05 * true))).fps > true


@pytest.mark.parametrize("velocities, verdict", [(0.0, None), (np.nan, None), (-1.0, "velocities that follow")])
def test_velocities_that_tell_no_rate_name_none(tmp_path, shared, velocities, verdict):
    """Placeholders say nothing; a sign that is turned is no rate."""
    with np.load(shared / "npz/amp_G1_dance.npz", allow_pickle=False) as arrays:
        true = arrays["dof_velocities"]
    path = altered(shared / "npz/amp_G1_dance.npz", tmp_path, dof_velocities=velocities * true)
    if verdict is None:
        assert not any(f.what == "rate" for f in read_clip(path).source.findings)
    else:
        with pytest.raises(ClipError, match=verdict):
            read_clip(path)


def test_a_stated_rate_is_believed(tmp_path, shared):
    true = read_clip(shared / "npz/amp_G1_dance.npz").fps
    assert read_clip(shared / "npz/amp_G1_dance.npz", ReadOptions(fps=0.5 * true)).fps == 0.5 * true


def test_bodies_that_are_no_numbers_are_refused(tmp_path, shared):
    content = dict(load(RawFile.load(shared / GMR[0])))
    content["local_body_pos"] = np.full(np.shape(content["local_body_pos"]), np.nan)
    with pytest.raises(ClipError, match="not finite"):
        read_clip(saved(tmp_path, content))


@pytest.mark.parametrize(
    "content", [{1: {2: 3}}, {"smpl_poses": np.zeros((9, 72)), "smpl_trans": np.zeros((9, 3)), "smpl_scaling": "x"}]
)
def test_odd_pickles_are_refused_and_nothing_else(tmp_path, content):
    with pytest.raises(ClipError):
        read_clip(saved(tmp_path, content), ReadOptions(fps=60.0))


@pytest.mark.parametrize("names", ["abc", np.array("abc"), []])
def test_names_that_are_none_are_left_alone(tmp_path, shared, names):
    content, clip = gmr_of(shared, ROBOTS_OWN[0], joint_names=names)
    np.testing.assert_allclose(read_clip(saved(tmp_path, content)).joint_pos, clip.joint_pos)
