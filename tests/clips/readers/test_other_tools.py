"""Files of the field's other tools: one dance, written eighteen ways, comes back the same; what is no such file is refused."""

import io
import json
import pathlib
import pickle
import struct
import sys
import types
from pathlib import Path
from typing import ClassVar

import numpy as np
import other_tools as tools
import pytest
from scipy.spatial.transform import Rotation

from clips import ClipError, ReadOptions, clips_in, read_clip
from clips.readers.body_model import joints_at_rest
from clips.readers.smpl import _JOINTS, _MEAN
from clips.readers.torch_pickle import load_storage, rebuild_tensor
from robot_models import load_robot

MILLIMETRE = 1e-3
RATE = ReadOptions(fps=30.0)


def the_dance():
    poses, trans = tools.poses_and_trans()
    parents = tuple(j[1] for j in _JOINTS)
    local = Rotation.from_rotvec(poses.reshape(-1, 3)).as_matrix().reshape(tools.FRAMES, 24, 3, 3)
    points, turns = np.zeros((tools.FRAMES, 22, 3)), np.zeros((tools.FRAMES, 22, 3, 3))
    for k, parent in enumerate(parents):
        if parent < 0:
            points[:, k], turns[:, k] = trans + _MEAN[0], local[:, 0]
        else:
            points[:, k] = points[:, parent] + np.einsum("tij,j->ti", turns[:, parent], _MEAN[k])
            turns[:, k] = turns[:, parent] @ local[:, k]
    return tools.Dance(
        poses=poses, trans=trans, names=tuple(j[0] for j in _JOINTS), parents=parents, points=points,
        turns=Rotation.from_matrix(turns.reshape(-1, 3, 3)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def dance():
    return the_dance()


@pytest.fixture(scope="module")
def folder(dance, tmp_path_factory):
    folder = tmp_path_factory.mktemp("tools")
    tools.smpl_files(folder, dance)
    tools.point_files(folder, dance)
    tools.trc(folder / "dance.trc", dance)
    tools.mvnx(folder / "dance.mvnx", dance)
    tools.motive(folder / "motive.csv", dance)
    tools.glb(folder / "dance.glb", dance)
    tools.vmd(folder / "dance.vmd", tools.steps_on_the_spot())
    return folder


def where(clip, names):
    """Points from the first pelvis on, in the file's own world turned to z up by the reader."""
    points = np.stack([clip.positions[:, clip.names.index(n)] for n in names], axis=1)
    pelvis = clip.positions[:1, clip.names.index(clip.landmarks["pelvis"])]
    return points - pelvis[:, None]


def danced(dance, names):
    points = np.stack([dance.points[:, dance.names.index(n)] for n in names], axis=1) - dance.points[:1, :1]
    return tools.Z_FROM_Y.apply(points.reshape(-1, 3)).reshape(points.shape)


@pytest.mark.parametrize(
    ("name", "dialect", "options"),
    [
        ("amass.npz", "AMASS-like SMPL", ReadOptions()), ("wham_output.pkl#3", "WHAM", RATE),
        ("hps_track_0.npy", "TRAM", RATE), ("motionx.npy", "Motion-X", RATE),
        ("joints22.npy", "points without names, 22", RATE), ("mdm_results.npy#1", "MDM", ReadOptions()),
        ("kimodo.npz", "Kimodo", RATE), ("dance.trc", "TRC, 22", ReadOptions()), ("dance.glb", "glTF", ReadOptions()),
        ("humanml3d.npy", "HumanML3D", ReadOptions()),
    ],
)  # fmt: skip
def test_a_persons_joints_come_back_to_the_millimetre(folder, dance, name, dialect, options):
    clip = read_clip(Path(f"{folder}/{name}"), options)
    assert clip.source.dialect.startswith(dialect)
    miss = where(clip, dance.names) - danced(dance, dance.names)
    # HumanML3D's world begins where the person faces; this dance begins turned by nothing.
    assert np.abs(miss).max() < MILLIMETRE
    if clip.orientations is not None:
        hand = clip.orientations[:, clip.names.index("left_wrist")][:, [1, 2, 3, 0]]
        want = tools.Z_FROM_Y * dance.turns_of(dance.names.index("left_wrist"))
        assert (Rotation.from_quat(hand) * want.inv()).magnitude().max() < 1e-4


@pytest.mark.parametrize(
    ("name", "bones", "dialect"),
    [("dance.mvnx", tools.XSENS, "MVNX, 19"), ("motive.csv", tools.MOTIVE, "Motive CSV, 19")],
)
def test_a_suits_and_a_rooms_segments_come_back_by_their_own_names(folder, dance, name, bones, dialect):
    clip = read_clip(folder / name)
    assert clip.source.dialect.startswith(dialect) and clip.fps == tools.FPS
    assert np.abs(where(clip, list(bones)) - danced(dance, list(bones.values()))).max() < MILLIMETRE
    assert clip.frames == tools.FRAMES  # a pose of calibration is none of the motion's
    hand = clip.orientation("left_wrist")[:, [1, 2, 3, 0]]
    want = tools.Z_FROM_Y * dance.turns_of(dance.names.index("left_wrist"))
    assert (Rotation.from_quat(hand) * want.inv()).magnitude().max() < 1e-4


def test_seventeen_points_are_told_from_coco_by_their_bones(folder, dance):
    clip = read_clip(folder / "h36m17.npy", RATE)
    assert clip.source.findings[1].value == "h36m17" and "coco17" in clip.source.findings[1].why
    assert np.abs(where(clip, ["left_knee"]) - danced(dance, ["left_knee"])).max() < MILLIMETRE


def test_points_of_no_order_are_refused_and_taken_with_their_names(dance, tmp_path):
    odd = np.concatenate((dance.points[:, ::-1], dance.points[:, :1]), axis=1)
    np.save(tmp_path / "odd.npy", odd)
    with pytest.raises(ClipError, match="23 points without names") as refusal:
        read_clip(tmp_path / "odd.npy", RATE)
    assert refusal.value.option == "layout"
    (tmp_path / "names.txt").write_text("\n".join((*dance.names[::-1], "again")))
    clip = read_clip(tmp_path / "odd.npy", ReadOptions(fps=30.0, layout=str(tmp_path / "names.txt")))
    assert np.abs(where(clip, ["left_wrist"]) - danced(dance, ["left_wrist"])).max() < MILLIMETRE
    np.save(tmp_path / "mixed.npy", dance.points[:, np.random.default_rng(0).permutation(22)])
    with pytest.raises(ClipError, match="an order in which the bones keep their length"):
        read_clip(tmp_path / "mixed.npy", RATE)


def test_estimators_never_say_the_films_rate(folder):
    for name in ("wham_output.pkl#3", "hps_track_0.npy"):
        with pytest.raises(ClipError, match="it is the film's") as refusal:
            read_clip(Path(f"{folder}/{name}"))
        assert refusal.value.option == "fps"


def test_two_people_of_a_film_are_asked_for(folder):
    with pytest.raises(ClipError, match="2 clips"):
        read_clip(folder / "wham_output.pkl", RATE)
    other = read_clip(Path(f"{folder}/wham_output.pkl#7"), RATE)
    first = read_clip(Path(f"{folder}/wham_output.pkl#3"), RATE)
    assert np.allclose(np.linalg.norm(other.positions - first.positions, axis=-1), np.sqrt(3.0))


def test_a_file_of_several_lists_them_all(folder, tmp_path):
    assert [p.name for p in clips_in(folder / "wham_output.pkl", RATE)] == ["wham_output.pkl#3", "wham_output.pkl#7"]
    assert [p.name for p in clips_in(folder / "mdm_results.npy")] == ["mdm_results.npy#a", "mdm_results.npy#b"]
    assert clips_in(folder / "dance.trc") == [folder / "dance.trc"]
    for path in clips_in(folder / "wham_output.pkl", RATE):
        assert read_clip(path, RATE).frames == tools.FRAMES
    content = np.load(folder / "mdm_results.npy", allow_pickle=True).item() | {"text": ["walk/run", "walk"]}
    np.save(tmp_path / "x.npy", content, allow_pickle=True)
    assert [p.name for p in clips_in(tmp_path / "x.npy")] == ["x.npy#1", "x.npy#2"]  # a name that would be a folder


def test_who_has_no_place_in_a_world_walks_by_the_feet(folder, dance):
    with pytest.raises(ClipError, match="no place in a world") as refusal:
        read_clip(folder / "demo_4dhumans.pkl", RATE)
    assert (refusal.value.option, refusal.value.suggestion) == ("travel", "from-feet")
    clip = read_clip(folder / "demo_4dhumans.pkl", ReadOptions(fps=30.0, travel="from-feet"))
    beside = where(clip, dance.names) - where(clip, ["pelvis"])
    want = danced(dance, dance.names) - danced(dance, ["pelvis"])
    assert np.abs(beside - want).max() < MILLIMETRE


def test_a_track_with_a_hole_is_refused(folder, tmp_path):
    import joblib

    content = joblib.load(folder / "wham_output.pkl")
    content[3]["frame_ids"] = np.r_[np.arange(20), np.arange(30, 50)]
    joblib.dump({3: content[3]}, tmp_path / "x.pkl")
    with pytest.raises(ClipError, match="not seen between frames 19 and 30"):
        read_clip(tmp_path / "x.pkl", RATE)


def test_normalised_features_are_no_person(folder, tmp_path):
    rows = np.load(folder / "humanml3d.npy")
    np.save(tmp_path / "x.npy", ((rows - rows.mean(axis=0)) / (rows.std(axis=0) + 1e-3)).astype(np.float32))
    with pytest.raises(ClipError):
        read_clip(tmp_path / "x.npy")


def test_torchs_files_are_read_with_torch_and_without_running_anything(folder, dance, tmp_path):
    pytest.importorskip("torch")
    robot = np.tile(load_robot("dancer").default_qpos, (20, 1)) + np.linspace(0, 0.05, 20)[:, None] * (
        np.arange(35) > 6
    )
    tools.torch_files(tmp_path, dance, robot)
    clip = read_clip(tmp_path / "hmr4d_results.pt", RATE)
    assert clip.source.dialect == "GVHMR result"
    assert np.abs(where(clip, dance.names) - danced(dance, dance.names)).max() < MILLIMETRE
    import torch

    torch.save(torch.zeros(20, 591), tmp_path / "bare.pt")  # as OMOMO's are: nothing in it says what its columns are
    with pytest.raises(ClipError, match=r"a bare Tensor of shape \(20, 591\)"):
        read_clip(tmp_path / "bare.pt", RATE)
    motion = read_clip(tmp_path / "phc_tensors.pkl", ReadOptions(source_robot="dancer"))
    assert np.array_equal(motion.joint_pos, robot[:, 7:]) and np.allclose(motion.root_quat, robot[:, 3:7])


def test_a_storage_that_lies_is_refused():
    torch = pytest.importorskip("torch")
    import io

    out = io.BytesIO()
    torch.save(torch.arange(6.0).untyped_storage(), out, _use_new_zipfile_serialization=False)
    for data in (b"", out.getvalue()[:-3], pickle.dumps(1)):
        with pytest.raises((ValueError, EOFError, pickle.UnpicklingError)):
            load_storage(data)
    with pytest.raises(ValueError, match="over 6 numbers"):
        rebuild_tensor(np.zeros(6), 0, (4, 2), (2, 1))
    with pytest.raises(ValueError, match="a tensor of shape"):
        rebuild_tensor(np.zeros(6), 0, (10**6, 10**6), (0, 0))  # terabytes of one number
    assert np.array_equal(rebuild_tensor(np.arange(6.0), 1, (2, 2), (2, 1)), [[1.0, 2.0], [3.0, 4.0]])

    class Evil:
        def __reduce__(self):
            return (print, ("never",))

    with pytest.raises(ValueError, match=r"builtins\.print"):
        load_storage(pickle.dumps(Evil()))


def test_miku_stands_where_her_keys_say(folder):
    clip = read_clip(folder / "dance.vmd")
    assert clip.source.dialect == "VMD, 5 bones with keys" and clip.frames == 61
    at = {k: clip.positions[:, clip.names.index(n)] for k, n in clip.landmarks.items()}
    # The left foot is lifted by two units of 8 cm at frame 15 and moved by one ahead, which is -z in the file.
    lift = at["left_ankle"][15] - at["left_ankle"][0]
    assert np.allclose(lift, [0.0, -0.08, 0.16], atol=1e-6)
    assert np.allclose(at["right_ankle"][45] - at["right_ankle"][0], [0.0, -0.08, 0.16], atol=1e-6)
    assert np.allclose(at["left_ankle"][11] - at["left_ankle"][0], lift / 2, atol=1e-3)  # a straight curve, halfway
    for side in ("left", "right"):
        for a, b in (("hip", "knee"), ("knee", "ankle")):
            length = np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=1)
            assert np.ptp(length) < 1e-9
    assert np.all(at["left_knee"][:, 1] < at["left_ankle"][:, 1] - 0.02)  # bent to the front, which is -y
    chest = Rotation.from_quat(
        clip.orientation("chest")[60][[1, 2, 3, 0]]
    )  # half a radian to the left in the file's own hand
    assert (chest * (tools.Z_FROM_Y * Rotation.from_rotvec([0.0, -0.5, 0.0])).inv()).magnitude() < 1e-6
    assert at["left_wrist"][60, 2] > at["left_wrist"][0, 2] + 0.1


def test_curves_of_a_vmd_ease(tmp_path):
    """Between two keys the way follows the curve of the later one: a step-like one stays behind, then leaps."""
    slow = bytes([107] * 4 + [20] * 4 + [127] * 4 + [20] * 4) * 4
    for name, curve in (("linear", tools.LINEAR), ("slow", slow)):
        tools.vmd(tmp_path / f"{name}.vmd", tools.steps_on_the_spot(), curve)
    straight, eased = (read_clip(tmp_path / f"{n}.vmd") for n in ("linear", "slow"))
    foot = straight.names.index(straight.landmarks["left_ankle"])
    halfway = [c.positions[11, foot, 2] - c.positions[0, foot, 2] for c in (straight, eased)]
    assert 0.0 < halfway[1] < 0.5 * halfway[0]


def test_a_vmd_of_ten_thousand_bones_costs_what_its_body_costs(tmp_path):
    hair = [(f"h{k}", 150_000, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)) for k in range(10_000)]
    tools.vmd(tmp_path / "x.vmd", [*tools.steps_on_the_spot(), *hair])
    clip = read_clip(tmp_path / "x.vmd")
    assert clip.frames == 61 and clip.source.dialect == "VMD, 5 bones with keys"


def test_a_cameras_vmd_is_no_dance(tmp_path):
    tools.vmd(tmp_path / "camera.vmd", [("カメラ", 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))] * 3)
    with pytest.raises(ClipError, match="keys of 0 bones"):
        read_clip(tmp_path / "camera.vmd")


def test_local_coordinates_and_missing_headers_of_motive_are_refused(folder, tmp_path):
    text = (folder / "motive.csv").read_text()
    for old, new, said in (
        ("Coordinate Space,Global", "Coordinate Space,Local", "Coordinate Space"), ("Millimeters", "Furlongs", "Length Units"),
        (",Type,", ",Kind,", "header rows"), ("Export Frame Rate,30.0", "Export Frame Rate,fast", "rate"),
    ):  # fmt: skip
        (tmp_path / "x.csv").write_text(text.replace(old, new))
        with pytest.raises(ClipError, match=said):
            read_clip(tmp_path / "x.csv")


def test_opensims_angles_are_sent_to_their_markers(tmp_path):
    (tmp_path / "x.mot").write_text(
        "Coordinates\nversion=1\nnRows=2\nnColumns=2\ninDegrees=yes\nendheader\ntime\tknee\n0\t1\n"
    )
    with pytest.raises(ClipError, match="give the TRC"):
        read_clip(tmp_path / "x.mot")


def test_entities_in_an_mvnx_are_refused(folder, tmp_path):
    text = (folder / "dance.mvnx").read_text().replace("<mvnx", '<!DOCTYPE x [<!ENTITY a "b">]><mvnx', 1)
    (tmp_path / "x.mvnx").write_text(text)
    with pytest.raises(ClipError, match="entities"):
        read_clip(tmp_path / "x.mvnx")


def test_nodes_of_a_glb_that_hang_on_themselves_are_refused(folder, tmp_path):
    import struct

    data = (folder / "dance.glb").read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + size])
    document["nodes"][1]["children"] = [0]
    text = json.dumps(document).encode().ljust(size + 64)
    body = struct.pack("<I4s", len(text), b"JSON") + text + data[20 + size :]
    (tmp_path / "x.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    with pytest.raises(ClipError, match="broken glTF"):
        read_clip(tmp_path / "x.glb")
    (tmp_path / "cut.glb").write_bytes(data[:-8])
    with pytest.raises(ClipError, match="as many as its header says"):
        read_clip(tmp_path / "cut.glb")


def body_model(path, tall=1.0):
    """A model of 22 vertices that are its joints; its first beta makes everything longer."""
    joints = np.zeros((22, 3))
    for k, (_, parent, offset) in enumerate(_JOINTS):
        joints[k] = np.array(offset) + (joints[parent] if parent >= 0 else 0.0)
    np.savez(path, J_regressor=np.eye(22), v_template=tall * joints, shapedirs=joints[..., None] * [0.1, 0.0])


def test_a_users_body_model_gives_the_bones_their_lengths(dance, tmp_path):
    poses, trans = tools.turned(tools.Z_FROM_Y, dance.poses, dance.trans)
    np.savez(
        tmp_path / "x.npz", poses=poses, trans=trans, mocap_framerate=30.0, betas=np.array([2.0, 1.0]), gender="female"
    )
    body_model(tmp_path / "model.npz")
    mean = read_clip(tmp_path / "x.npz")
    shaped = read_clip(tmp_path / "x.npz", ReadOptions(body_model=str(tmp_path / "model.npz")))
    thigh = [np.linalg.norm(c.point("left_hip") - c.point("left_knee"), axis=1).mean() for c in (mean, shaped)]
    assert np.isclose(thigh[1], 1.2 * thigh[0]) and np.isclose(shaped.height, 1.2 * mean.height)
    assert any(f.what == "skeleton" and "female" in f.why for f in shaped.source.findings)
    (tmp_path / "empty.pkl").write_bytes(b"\x80\x02}.")
    with pytest.raises(ClipError, match=r"no J_regressor, v_template, shapedirs"):
        read_clip(tmp_path / "x.npz", ReadOptions(body_model=str(tmp_path / "empty.pkl")))
    np.savez(tmp_path / "none.npz", v_template=np.zeros((3, 3)))
    with pytest.raises(ClipError, match="no J_regressor"):
        read_clip(tmp_path / "x.npz", ReadOptions(body_model=str(tmp_path / "none.npz")))


class _Python2(pickle._Pickler):
    """A pickler whose bytes are Python 2's text, as in the files of SMPL's makers."""

    def save_bytes(self, obj):
        self.write(pickle.BINSTRING + struct.pack("<i", len(obj)) + obj)

    dispatch: ClassVar = pickle._Pickler.dispatch | {bytes: save_bytes}


def makers_pickle(path, arrays, monkeypatch, **changed):
    """A model as its makers pickle it: chumpy's variables, a sparse regressor, and what else a body has."""
    from scipy.sparse import csc_matrix

    chumpy = types.ModuleType("chumpy.ch")
    chumpy.Ch = type("Ch", (), {"__module__": "chumpy.ch"})
    monkeypatch.setitem(sys.modules, "chumpy.ch", chumpy)
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    directions = chumpy.Ch()
    directions.__dict__ = {"x": arrays["shapedirs"], "_dirty_vars": [], "_itr": None}
    whole = {
        "J_regressor": csc_matrix(arrays["J_regressor"]),
        "v_template": arrays["v_template"],
        "shapedirs": directions,
    }
    stream = io.BytesIO()
    _Python2(stream, protocol=2).dump(whole | {"bs_style": "lbs", "f": np.zeros((4, 3), dtype=np.uint32)} | changed)
    path.write_bytes(stream.getvalue().replace(b"scipy.sparse._csc", b"scipy.sparse.csc"))


def test_a_body_model_in_its_makers_pickle_is_the_same_model_and_nothing_of_it_is_run(tmp_path, monkeypatch):
    body_model(tmp_path / "model.npz")
    with np.load(tmp_path / "model.npz") as file:
        arrays = dict(file)
    makers_pickle(tmp_path / "model.pkl", arrays, monkeypatch)
    monkeypatch.undo()
    betas = np.array([2.0, 1.0])
    np.testing.assert_array_equal(
        joints_at_rest(tmp_path / "model.pkl", betas), joints_at_rest(tmp_path / "model.npz", betas)
    )
    makers_pickle(tmp_path / "evil.pkl", arrays, monkeypatch, v_template=pathlib.PurePosixPath("/"))
    with pytest.raises(ClipError, match="wants to call pathlib"):
        joints_at_rest(tmp_path / "evil.pkl", betas)
    data = (tmp_path / "model.pkl").read_bytes()
    for damaged in (data[:-40], data.replace(b"indptr", b"indpro"), data.replace(b"_shape", b"_shade")):
        (tmp_path / "bad.pkl").write_bytes(damaged)
        with pytest.raises(ClipError, match="broken pickle|sparse matrix that is none"):
            joints_at_rest(tmp_path / "bad.pkl", betas)


@pytest.mark.parametrize("first", ["position", "quaternion"])
def test_a_whole_qpos_without_names_is_taken_in_either_order_of_its_root(groove, tmp_path, first):
    motion = groove.reference
    root, quat = motion.body_pos_w[:, 0], motion.body_quat_w[:, 0]
    columns = (root, quat) if first == "position" else (quat, root)
    np.savez(tmp_path / "x.npz", qpos=np.hstack((*columns, motion.joint_pos)), fps=motion.fps)
    clip = read_clip(tmp_path / "x.npz", ReadOptions(source_robot="dancer"))
    assert clip.source.dialect == "qpos archive" and np.abs(clip.joint_pos - motion.joint_pos).max() < 1e-6
    assert np.abs(clip.root_pos - root).max() < 1e-6
    np.savez(tmp_path / "x.npz", qpos=np.hstack((root, 2.0 * quat, motion.joint_pos)), fps=motion.fps)
    with pytest.raises(ClipError, match="unit quaternion"):
        read_clip(tmp_path / "x.npz", ReadOptions(source_robot="dancer"))


def test_holosomas_motion_has_its_root_among_its_joints_and_the_world_among_its_bodies(groove, tmp_path):
    motion = groove.reference
    frames = len(motion.joint_pos)
    root = np.hstack((motion.body_pos_w[:, 0], motion.body_quat_w[:, 0]))
    world, upright = np.zeros((frames, 1, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1, 1))
    arrays = {
        "fps": np.array([motion.fps]), "joint_pos": np.hstack((root, motion.joint_pos)),
        "joint_vel": np.hstack((np.zeros((frames, 6)), motion.joint_vel)), "joint_names": np.array(motion.joint_names),
        "body_names": np.array(["world", *motion.body_names]),
        "body_pos_w": np.concatenate((world, motion.body_pos_w), axis=1),
        "body_quat_w": np.concatenate((upright, motion.body_quat_w), axis=1),
    }  # fmt: skip
    np.savez(tmp_path / "x.npz", **arrays)
    clip = read_clip(tmp_path / "x.npz")
    assert "holosoma" in clip.source.dialect and clip.robot == groove.reference.robot
    assert np.abs(clip.joint_pos - motion.joint_pos).max() < 1e-6
    np.savez(tmp_path / "x.npz", **(arrays | {"body_pos_w": arrays["body_pos_w"] + 0.5}))
    with pytest.raises(ClipError, match="not where its first body is"):
        read_clip(tmp_path / "x.npz")


def test_phumas_dictionary_is_a_robots_motion(groove, tmp_path):
    motion = groove.reference
    content = {
        "root_trans": motion.body_pos_w[:, 0], "root_ori": motion.body_quat_w[:, 0][:, [1, 2, 3, 0]],
        "dof_pos": motion.joint_pos, "fps": motion.fps,
    }  # fmt: skip
    np.save(tmp_path / "x.npy", content, allow_pickle=True)
    clip = read_clip(tmp_path / "x.npy", ReadOptions(source_robot="dancer"))
    assert clip.source.dialect == "PHUMA motion" and np.abs(clip.joint_pos - motion.joint_pos).max() < 1e-6
