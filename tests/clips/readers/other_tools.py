"""One dance as the tools of the field write it, each by a writer that shares nothing with the readers but SciPy's rotations."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray
from scipy.spatial.transform import Rotation

FRAMES, FPS = 40, 30.0
Z_FROM_Y = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
CAMERA_FROM_Y = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])
PELVIS = np.array([-0.0018, -0.2233, 0.0282])  # of the mean body, from the model's origin


@dataclass(frozen=True, kw_only=True)
class Dance:
    """Somebody who sways and lifts the arms, y up; what a z-up AMASS file of it holds, and where its joints are."""

    poses: ndarray  # (T, 72) axis-angle, the root's in a y-up world
    trans: ndarray  # (T, 3)
    names: tuple[str, ...]
    parents: tuple[int, ...]
    points: ndarray  # (T, 22, 3)
    turns: Rotation  # of (T * 22)

    def turns_of(self, joint: int) -> Rotation:
        """A joint's turns in the world."""
        return Rotation.from_quat(self.turns.as_quat().reshape(FRAMES, 22, 4)[:, joint])


def poses_and_trans() -> tuple[ndarray, ndarray]:
    """What is danced: knees bent and straightened, arms swung, the body turned and shifted."""
    t = np.arange(FRAMES)[:, None] / FPS
    poses = np.zeros((FRAMES, 24, 3))
    poses[:, 0] = np.hstack((0.05 * np.sin(3 * t), 0.6 * np.sin(2 * t), 0.03 * np.cos(3 * t)))
    poses[:, [1, 2], 0] = -0.4 + 0.2 * np.sin(4 * t)
    poses[:, [4, 5], 0] = 0.8 - 0.4 * np.sin(4 * t)
    poses[:, [7, 8], 0] = -0.4 + 0.2 * np.sin(4 * t)
    poses[:, 16, 2], poses[:, 17, 2] = (-1.0 + 0.5 * np.sin(3 * t))[:, 0], (1.0 + 0.5 * np.sin(3 * t))[:, 0]
    poses[:, 18, 1], poses[:, 19, 1] = (-0.5 - 0.3 * np.sin(5 * t))[:, 0], (0.5 + 0.3 * np.sin(5 * t))[:, 0]
    return poses.reshape(FRAMES, 72), np.hstack((0.2 * np.sin(2 * t), 1.1 + 0.0 * t, 0.1 * t))


def turned(rotation: Rotation, poses: ndarray, trans: ndarray) -> tuple[ndarray, ndarray]:
    """The same in another world; a translation is of the model's origin and not of the pelvis."""
    root = (rotation * Rotation.from_rotvec(poses[:, :3])).as_rotvec()
    return np.hstack((root, poses[:, 3:])), rotation.apply(trans + PELVIS) - PELVIS


def smpl_files(folder: Path, dance: Dance) -> None:
    """AMASS, GVHMR, WHAM, TRAM, 4D-Humans, Motion-X."""
    import joblib

    poses, trans = dance.poses, dance.trans
    in_z, trans_z = turned(Z_FROM_Y, poses, trans)
    np.savez(folder / "amass.npz", poses=in_z, trans=trans_z, mocap_framerate=FPS, betas=np.zeros(10), gender="neutral")
    world = {"pose_world": poses, "trans_world": trans, "betas": np.zeros((FRAMES, 10)), "frame_ids": np.arange(FRAMES)}
    joblib.dump({3: world, 7: world | {"trans_world": trans + 1.0}}, folder / "wham_output.pkl")
    seen, place = turned(CAMERA_FROM_Y, poses, trans)
    turns = Rotation.from_rotvec(seen.reshape(-1, 3)).as_matrix().reshape(FRAMES, 24, 3, 3)
    track = {
        "pred_rotmat": turns,
        "pred_trans": place[:, None],
        "pred_shape": np.zeros((FRAMES, 10)),
        "frame": np.arange(FRAMES),
    }
    np.save(folder / "hps_track_0.npy", track, allow_pickle=True)
    images = {
        f"img/{k:06d}.jpg": {
            "tid": [1], "smpl": [{"global_orient": turns[k, :1], "body_pose": turns[k, 1:], "betas": np.zeros(10)}],
            "camera": [place[k]],
        }
        for k in range(FRAMES)
    }  # fmt: skip
    joblib.dump(images, folder / "demo_4dhumans.pkl")
    rows = np.zeros((FRAMES, 322))
    rows[:, :66], rows[:, 309:312] = poses[:, :66], trans
    np.save(folder / "motionx.npy", rows)


def torch_files(folder: Path, dance: Dance, robot: ndarray) -> None:
    """GVHMR's archive, and a robot's motion as PHC pickles it, tensors and all."""
    import pickle

    import torch

    body = {
        "global_orient": torch.tensor(dance.poses[:, :3]), "body_pose": torch.tensor(dance.poses[:, 3:66]),
        "transl": torch.tensor(dance.trans), "betas": torch.zeros(FRAMES, 10),
    }  # fmt: skip
    torch.save(
        {"smpl_params_global": body, "K_fullimg": torch.eye(3), "net_outputs": {"x": body}}, folder / "hmr4d_results.pt"
    )
    motion = {
        "root_trans_offset": torch.tensor(robot[:, :3]), "root_rot": torch.tensor(robot[:, [4, 5, 6, 3]]),
        "dof": torch.tensor(robot[:, 7:])[:, :], "fps": 50,
    }  # fmt: skip
    (folder / "phc_tensors.pkl").write_bytes(pickle.dumps({"clip": motion}))


def point_files(folder: Path, dance: Dance) -> None:
    """Joints without names, MDM's results, Human3.6M's 17, Kimodo's archive."""
    points = dance.points
    np.save(folder / "joints22.npy", points.astype(np.float32))
    two = np.moveaxis(np.stack((points, points[::-1])), 1, -1).astype(np.float32)
    np.save(folder / "mdm_results.npy", {"motion": two, "text": ["a", "b"], "lengths": np.array([FRAMES, FRAMES - 5])})
    at = {n: points[:, k] for k, n in enumerate(dance.names)}
    h36m = (
        "pelvis right_hip right_knee right_ankle left_hip left_knee left_ankle spine2 neck head head left_shoulder left_elbow "
        "left_wrist right_shoulder right_elbow right_wrist"
    )
    np.save(folder / "h36m17.npy", np.stack([at[n] for n in h36m.split()], axis=1))
    matrices = dance.turns.as_matrix().reshape(1, FRAMES, 22, 3, 3)
    np.savez(
        folder / "kimodo.npz",
        posed_joints=points[None],
        global_rot_mats=matrices,
        foot_contacts=np.zeros((1, FRAMES, 4)),
    )
    np.save(folder / "humanml3d.npy", features(dance).astype(np.float32))


def features(dance: Dance) -> ndarray:
    """HumanML3D's columns that a motion is made of again: turn and step of the root, its height, joints beside it."""
    points = dance.points
    across = points[:, 1] - points[:, 2] + points[:, 16] - points[:, 17]
    heading = np.unwrap(np.arctan2(-across[:, 2], across[:, 0]))  # 0 where the left is along +x, and the front along +z
    heading -= heading[0]
    to_front = Rotation.from_rotvec(np.outer(-heading, [0.0, 1.0, 0.0]))
    rows = np.zeros((FRAMES, 263))
    rows[:-1, 0] = -0.5 * np.diff(heading)  # half angles, and of the world against the person
    steps = to_front[1:].apply(np.diff(points[:, 0], axis=0))
    rows[:-1, 1], rows[:-1, 2] = steps[:, 0], steps[:, 2]
    rows[:, 3] = points[:, 0, 1]
    beside = points[:, 1:] - points[:, :1] * [1.0, 0.0, 1.0]
    for k in range(21):
        rows[:, 4 + 3 * k : 7 + 3 * k] = to_front.apply(beside[:, k])
    return rows


def trc(path: Path, dance: Dance) -> None:
    """OpenSim's text of markers, in millimetres."""
    names = dance.names
    head = [
        "PathFileType\t4\t(X/Y/Z)\tdance.trc", "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"{FPS}\t{FPS}\t{FRAMES}\t{len(names)}\tmm", "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"X{k + 1}\tY{k + 1}\tZ{k + 1}" for k in range(len(names))), "",
    ]  # fmt: skip
    rows = [
        f"{k + 1}\t{k / FPS:.4f}\t" + "\t".join(f"{v:.4f}" for v in 1000.0 * dance.points[k].ravel())
        for k in range(FRAMES)
    ]
    path.write_text("\n".join((*head, *rows)) + "\n")


XSENS = {
    "Pelvis": "pelvis", "L5": "spine1", "T8": "spine3", "Neck": "neck", "Head": "head", "LeftUpperLeg": "left_hip",
    "LeftLowerLeg": "left_knee", "LeftFoot": "left_ankle", "LeftToe": "left_foot", "RightUpperLeg": "right_hip",
    "RightLowerLeg": "right_knee", "RightFoot": "right_ankle", "RightToe": "right_foot", "LeftUpperArm": "left_shoulder",
    "LeftForeArm": "left_elbow", "LeftHand": "left_wrist", "RightUpperArm": "right_shoulder", "RightForeArm": "right_elbow",
    "RightHand": "right_wrist",
}  # fmt: skip
MOTIVE = {
    "Hip": "pelvis", "Ab": "spine1", "Chest": "spine3", "Neck": "neck", "Head": "head", "LThigh": "left_hip",
    "LShin": "left_knee", "LFoot": "left_ankle", "LToe": "left_foot", "RThigh": "right_hip", "RShin": "right_knee",
    "RFoot": "right_ankle", "RToe": "right_foot", "LUArm": "left_shoulder", "LFArm": "left_elbow", "LHand": "left_wrist",
    "RUArm": "right_shoulder", "RFArm": "right_elbow", "RHand": "right_wrist",
}  # fmt: skip


def mvnx(path: Path, dance: Dance) -> None:
    """Xsens' XML, z up, with a pose of calibration before the motion."""
    places = [dance.names.index(n) for n in XSENS.values()]
    points = Z_FROM_Y.apply(dance.points.reshape(-1, 3)).reshape(dance.points.shape)[:, places]
    quats = (Z_FROM_Y * dance.turns).as_quat().reshape(FRAMES, 22, 4)[:, places][..., [3, 0, 1, 2]]
    words = [
        '<?xml version="1.0"?><mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="4">',
        f'<subject label="Ben" frameRate="{FPS:g}"><segments>',
        *(f'<segment label="{name}" id="{k + 1}"/>' for k, name in enumerate(XSENS)),
        "</segments><joints><joint label='jL5S1'><connector1>Pelvis/jL5S1</connector1><connector2>L5/jL5S1</connector2></joint>",
        "</joints><frames><frame type='tpose'><position>0</position></frame>",
        *(
            f"<frame type='normal'><orientation>{' '.join(f'{v:.7f}' for v in q.ravel())}</orientation>"
            f"<position>{' '.join(f'{v:.6f}' for v in p.ravel())}</position></frame>"
            for p, q in zip(points, quats, strict=True)
        ),
        "</frames></subject></mvnx>",
    ]
    path.write_text("\n".join(words))


def motive(path: Path, dance: Dance) -> None:
    """OptiTrack's CSV of a skeleton's bones, in millimetres."""
    places = [dance.names.index(n) for n in MOTIVE.values()]
    quats = dance.turns.as_quat().reshape(FRAMES, 22, 4)
    width = 7
    rows = [
        f"Format Version,1.23,Take Name,a,Capture Frame Rate,120.0,Export Frame Rate,{FPS},Rotation Type,Quaternion,"
        "Length Units,Millimeters,Coordinate Space,Global", "",
        ",Type," + ",".join(["Bone"] * width * len(MOTIVE)),
        ",Name," + ",".join(f"Ben:{n}" for n in MOTIVE for _ in range(width)),
        ",ID," + ",".join(str(k) for k in range(len(MOTIVE)) for _ in range(width)),
        ",," + ",".join((["Rotation"] * 4 + ["Position"] * 3) * len(MOTIVE)),
        "Frame,Time (Seconds)," + ",".join("XYZWXYZ" * len(MOTIVE)),
    ]  # fmt: skip
    for k in range(FRAMES):
        cells = [f"{v:.6f}" for p in places for v in (*quats[k, p], *(1000.0 * dance.points[k, p]))]
        rows.append(f"{k},{k / FPS:.6f}," + ",".join(cells))
    path.write_text("\n".join(rows) + "\n")


def glb(path: Path, dance: Dance) -> None:
    """glTF's binary form: a rotation of every joint at every frame, and the root's way."""
    packed, views, accessors, channels, samplers = b"", [], [], [], []

    def add(array: ndarray, kind: str) -> int:
        nonlocal packed
        data = np.asarray(array, "<f4").tobytes()
        views.append({"buffer": 0, "byteOffset": len(packed), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": len(array), "type": kind})
        packed += data
        return len(accessors) - 1

    times, nodes = add(np.arange(FRAMES)[:, None] / FPS, "SCALAR"), []
    for k, parent in enumerate(dance.parents):
        own = dance.turns_of(k)
        local = (
            dance.points[:, k]
            if parent < 0
            else dance.turns_of(parent).inv().apply(dance.points[:, k] - dance.points[:, parent])
        )
        turn = own if parent < 0 else dance.turns_of(parent).inv() * own
        children = [c for c, p in enumerate(dance.parents) if p == k]
        nodes.append(
            {"name": dance.names[k], "translation": local[0].tolist(), **({"children": children} if children else {})}
        )
        for what, values, kind in (("rotation", turn.as_quat(), "VEC4"), ("translation", local, "VEC3")):
            if what == "rotation" or parent < 0:
                samplers.append({"input": times, "output": add(values, kind)})
                channels.append({"sampler": len(samplers) - 1, "target": {"node": k, "path": what}})
    document = {
        "asset": {"version": "2.0"}, "nodes": nodes, "skins": [{"joints": list(range(22))}], "accessors": accessors,
        "animations": [{"name": "dance", "channels": channels, "samplers": samplers}], "bufferViews": views,
        "buffers": [{"byteLength": len(packed)}],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(packed), b"BIN\0") + packed
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


LINEAR = bytes([20] * 8 + [107] * 8) * 4


def vmd(path: Path, keys: list[tuple[str, int, tuple[float, ...], tuple[float, ...]]], curve: bytes = LINEAR) -> None:
    """MikuMikuDance's keys: bone, frame, place in units and quaternion xyzw, both left-handed with z behind."""
    rows = [
        struct.pack("<15sI3f4f64s", name.encode("shift_jis"), frame, *pos, *quat, curve)
        for name, frame, pos, quat in keys
    ]
    head = struct.pack("<30s20sI", b"Vocaloid Motion Data 0002", "figure".encode("shift_jis"), len(rows))
    path.write_bytes(head + b"".join(rows) + struct.pack("<5I", 0, 0, 0, 0, 0))


def steps_on_the_spot() -> list[tuple[str, int, tuple[float, ...], tuple[float, ...]]]:
    """Feet lifted in turn by their IK bones, an arm raised, the body lowered and turned."""
    still, none = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    turn = (0.0, float(np.sin(0.25)), 0.0, float(np.cos(0.25)))
    raised = (0.0, 0.0, float(np.sin(0.5)), float(np.cos(0.5)))
    keys = [("センター", f, (0.0, -1.0, 0.0), still) for f in (0, 60)]
    keys += [
        ("上半身", 0, none, still),
        ("上半身", 60, none, turn),
        ("左腕", 0, none, still),
        ("左腕", 60, none, raised),
    ]
    for side, frame in (("左", 15), ("右", 45)):
        keys += [
            (f"{side}足ＩＫ", f, (0.0, 2.0 * (f == frame), -1.0 * (f == frame)), still)
            for f in (0, frame - 8, frame, frame + 8, 60)
        ]
    return keys
