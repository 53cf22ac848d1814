"""AIST++, LocoMuJoCo, ProtoMotions, MediaPipe: what is converted, and what is refused with the line to type."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, HumanClip, ReadOptions, full_qpos, read_clip, repair
from clips.identify.robot import _stands
from clips.provenance import RawFile
from robot_models import load_robot
from robot_models.maths import rotation as rot


def dance(frames=40):
    """SMPL poses, y up: knees bent, an arm that swings."""
    poses = np.zeros((frames, 24, 3))
    poses[:, [4, 5], 0] = 0.4
    poses[:, [1, 2], 0] = -0.2
    poses[:, 16, 2] = -1.2 + 0.3 * np.sin(np.linspace(0, 6, frames))
    poses[:, 17, 2] = 1.2
    trans = np.tile([0.1, 1.15, 0.0], (frames, 1))
    return poses.reshape(frames, 72), trans


def write(path, **content):
    path.write_bytes(pickle.dumps(content))
    return path


def test_aists_translation_is_divided_by_its_scaling(tmp_path):
    poses, trans = dance()
    plain = read_clip(write(tmp_path / "a.pkl", smpl_poses=poses, smpl_trans=trans), ReadOptions(fps=30))
    file = write(
        tmp_path / "b.pkl", smpl_poses=poses.astype(np.float32), smpl_trans=93.78 * trans, smpl_scaling=np.array([93.78]),
        smpl_loss=0.1,
    )  # fmt: skip
    scaled = read_clip(file, ReadOptions(fps=60))
    assert isinstance(scaled, HumanClip) and scaled.fps == 60.0
    np.testing.assert_allclose(scaled.positions, plain.positions, atol=1e-5)
    found = {f.what: f.value for f in scaled.source.findings}
    assert found["up axis"] == "y" and found["unit"] == "m"
    assert 0.8 < np.median(scaled.positions[:, 0, 2]) < 1.1


def test_aist_without_a_rate_or_with_a_wrong_scaling_is_refused(tmp_path):
    poses, trans = dance()
    with pytest.raises(ClipError, match="60, EDGE's outputs at 30") as caught:
        read_clip(write(tmp_path / "a.pkl", smpl_poses=poses, smpl_trans=trans))
    assert caught.value.option == "fps"
    with pytest.raises(ClipError, match="smpl_scaling"):
        file = write(tmp_path / "a.pkl", smpl_poses=poses, smpl_trans=trans, smpl_scaling=np.array([0.0]))
        read_clip(file, ReadOptions(fps=60))


def trajectory(path, robot, frames=40, **changes):
    qpos = np.tile(robot.default_qpos, (frames, 1))
    qpos[:, 3:7] = rot.from_yaw(np.linspace(0.3, 0.9, frames))
    qpos[:, 7:] += 0.1 * np.sin(np.linspace(0, 5, frames))[:, None]
    qpos[:, 7:] = np.clip(qpos[:, 7:], robot.lower, robot.upper)
    order = np.random.default_rng(0).permutation(len(robot.joint_names))
    content = {
        "qpos": np.concatenate((qpos[:, :7], qpos[:, 7 + order]), axis=1), "qvel": np.zeros((frames, robot.nq - 1)),
        "joint_names": np.array(["root", *(robot.joint_names[i] for i in order)]), "frequency": 40.0,
        "split_points": np.array([0, frames]),
    } | changes  # fmt: skip
    np.savez(path, **content)
    return qpos


def test_loco_mujocos_joints_go_by_name_whatever_their_order(tmp_path):
    robot = load_robot("dancer")
    qpos = trajectory(tmp_path / "t.npz", robot)
    clip = read_clip(tmp_path / "t.npz")
    assert clip.robot == "dancer" and clip.fps == 40.0
    np.testing.assert_allclose(full_qpos(clip, robot), qpos, atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"split_points": np.array([0, 10, 40])}, "2 clips.*say which"),
        ({"split_points": np.array([0, 10, 39, 40])}, "split_points"),
        ({"split_points": np.array([5, 10, 40])}, "split_points"),
        ({"qpos": np.zeros((40, 20))}, "a free root and one per joint"),
        ({"joint_names": np.array(["root", *(f"j{i}" for i in range(28))])}, "names of joints that fit no robot"),
        ({"frequency": np.zeros(3)}, "no frame rate"),
    ],
)
def test_a_trajectory_that_does_not_fit_is_refused(tmp_path, changes, said):
    trajectory(tmp_path / "t.npz", load_robot("dancer"), **changes)
    with pytest.raises(ClipError, match=said):
        read_clip(tmp_path / "t.npz")


def test_one_of_several_trajectories_is_asked_for_by_number_or_name(tmp_path):
    robot = load_robot("dancer")
    qpos = trajectory(tmp_path / "t.npz", robot, split_points=np.array([0, 15, 40]))
    for asked, frames in (("1", slice(0, 15)), ("trajectory 2", slice(15, 40))):
        clip = read_clip(Path(f"{tmp_path}/t.npz#{asked}"))
        np.testing.assert_allclose(full_qpos(clip, robot), qpos[frames], atol=1e-12)
    with pytest.raises(ClipError, match=r"no clip '3' among 2 \(trajectory 1, trajectory 2\)"):
        read_clip(tmp_path / "t.npz", ReadOptions(person="3"))


def test_protomotions_tensors_are_read_by_torchs_safe_loader(groove, tmp_path):
    torch = pytest.importorskip("torch")
    reference, path = groove.reference, tmp_path / "dance.motion"
    quat = reference.body_quat_w[..., [1, 2, 3, 0]]
    arrays = {"dof_pos": reference.joint_pos, "rigid_body_pos": reference.body_pos_w, "rigid_body_rot": quat}
    torch.save({k: torch.tensor(np.array(v)) for k, v in arrays.items()} | {"fps": 50, "motion": None}, path)
    clip = read_clip(path)
    assert (clip.robot, clip.fps) == ("dancer", 50.0)
    np.testing.assert_allclose(full_qpos(clip, load_robot("dancer")), reference.qpos, atol=1e-9)
    torch.save({"dof_pos": np.zeros(3, dtype=object)}, path)
    with pytest.raises(ClipError, match="does not open as plain tensors"):
        read_clip(path)
    torch.save({"weights": torch.zeros(3)}, path)
    with pytest.raises(ClipError, match="no dof_pos, rigid_body_pos, rigid_body_rot among weights"):
        read_clip(path)


@pytest.mark.parametrize("prefix", ["", "body_"])
def test_mediapipes_points_are_named_in_its_own_way(tmp_path, prefix):
    """MediaPipe's and FreeMoCap's 33 names in millimetres, z up, with face, fingers and heels beside the body's."""
    person = repair(read_clip(SAMPLES / "groove.bvh"))
    named = {n: person.point(n) for n in person.landmarks if n.split("_")[-1] in BODY}
    named |= {f"{s}_foot_index": person.point(f"{s}_toe") for s in ("left", "right")}
    named |= {f"{s}_heel": person.point(f"{s}_ankle") - [0.05, 0.0, 0.05] for s in ("left", "right")}
    named |= {
        f"{s}_{p}": person.point(f"{s}_wrist") + 0.05 for s in ("left", "right") for p in ("pinky", "index", "thumb")
    }
    named["nose"] = person.point("neck") + [0.1, 0.0, 0.1]
    table = np.concatenate([1000.0 * named[n] for n in named], axis=1)
    header = ",".join(f"{prefix}{n}_{a}" for n in named for a in "xyz")
    lines = ["# fps: 60", header, *(",".join(f"{v:.3f}" for v in row) for row in table)]
    (tmp_path / "mediapipe.csv").write_text("\n".join(lines))
    clip = read_clip(tmp_path / "mediapipe.csv")
    assert {f.what: f.value for f in clip.source.findings}["unit"] == "mm"
    for landmark in ("left_hip", "right_ankle", "left_toe", "right_wrist"):
        np.testing.assert_allclose(clip.point(landmark), person.point(landmark), atol=1e-5)


BODY = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")


def test_feet_that_never_stand_flat_are_refused_only_where_the_columns_have_no_names():
    raw = RawFile(path=Path("x.npz"), data=b"")
    robot, frames = load_robot("g1"), 20
    pose = np.tile(robot.default_qpos, (frames, 1))
    for side in ("left", "right"):
        pose[:, 7 + robot.joint(f"{side}_ankle_pitch_joint")] = 0.5
    parts = list(range(29)), pose[:, :3], pose[:, 3:7], pose[:, 7:]
    assert _stands(raw, robot, *parts, "wxyz", named=True)
    with pytest.raises(ClipError, match="stand flat now and then"):
        _stands(raw, robot, *parts, "wxyz", named=False)
