"""Motions in the layouts that other tools read, each by its own rules of order, quaternion and rate."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy import ndarray

from clips.clip import RobotClip, full_qpos
from clips.edit import resample
from clips.errors import ClipError
from clips.files import write_whole
from clips.identify import breadth_first
from clips.provenance import ReadOptions
from clips.readers import read_clip
from clips.reference import FREE, Reference, make_reference
from robot_models import RobotModel
from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True)
class Layout:
    """One file layout."""

    title: str
    suffix: str
    fps: float | None  # that its readers take for granted, because the file does not say; None: written into it
    write: Callable[[IO[bytes], Reference, RobotModel, str], None]


def write_motion(path: Path, layout: str, clip: RobotClip, robot: RobotModel, fps: float | None = None) -> Reference:
    """Write a robot's motion in another tool's layout.

    Args:
        path: the file.
        layout: key of `LAYOUTS`.
        clip: the motion, in joint space.
        robot: its robot.
        fps: rate to write; by default the layout's own, or the clip's.

    Returns:
        What was written, at the rate that it was written at.

    Raises:
        ClipError: an unknown layout, or a rate that the layout's readers would not expect.
    """
    if layout not in LAYOUTS:
        raise ClipError("layout", found=repr(layout), expected=f"one of {', '.join(LAYOUTS)}")
    known = LAYOUTS[layout]
    if known.fps is not None and fps not in (None, known.fps):
        raise ClipError(
            f"layout {layout}",
            found=f"{fps:g} fps",
            expected=f"{known.fps:g}: the file does not say, and its readers assume it",
        )
    rated = resample(clip, known.fps or fps or clip.fps)
    assert isinstance(rated, RobotClip)
    qpos = full_qpos(rated, robot)
    motion = make_reference(
        robot, qpos, rated.fps, contact=np.full((len(qpos), 4), FREE), segments=np.array([[0, len(qpos), 0]]), meta={}
    )
    with write_whole(path) as stream:
        known.write(stream, motion, robot, path.stem)
    return motion


def read_back(path: Path, motion: Reference, robot: RobotModel) -> float:
    """How far the joints of a written file are from the motion that was written, when it is read again [rad]."""
    again = read_clip(path, ReadOptions(fps=motion.fps, source_robot=robot.name))
    assert isinstance(again, RobotClip)
    return float(np.abs(full_qpos(again, robot)[:, 7:] - motion.joint_pos).max())


def _unitree_csv(stream: IO[bytes], motion: Reference, _robot: RobotModel, _name: str) -> None:
    qpos = motion.qpos
    rows = np.concatenate((qpos[:, :3], rot.to_quat_xyzw(qpos[:, 3:7]), qpos[:, 7:]), axis=1)
    np.savetxt(stream, rows, fmt="%.9g", delimiter=",")


def _gmr(stream: IO[bytes], motion: Reference, _robot: RobotModel, _name: str) -> None:
    content = {
        "fps": _whole(motion.fps),
        "root_pos": motion.body_pos_w[:, 0],
        "root_rot": rot.to_quat_xyzw(motion.body_quat_w[:, 0]),
        "dof_pos": motion.joint_pos,
        "local_body_pos": None,
        "link_body_list": None,
    }
    pickle.dump(_own(content), stream, protocol=4)


def _phc(stream: IO[bytes], motion: Reference, robot: RobotModel, name: str) -> None:
    import joblib

    axes = np.array([robot.model.jnt_axis[1 + i] for i in range(len(robot.joint_names))])
    turns = np.concatenate((rot.log(motion.body_quat_w[:, :1]), motion.joint_pos[..., None] * axes), axis=1)
    content = {
        "root_trans_offset": motion.body_pos_w[:, 0],
        "root_rot": rot.to_quat_xyzw(motion.body_quat_w[:, 0]),
        "dof": motion.joint_pos,
        "pose_aa": turns,
        "fps": _whole(motion.fps),
    }
    joblib.dump({name: _own(content)}, stream, compress=3)


def _mujoco_npz(stream: IO[bytes], motion: Reference, robot: RobotModel, _name: str) -> None:
    _motion_npz(
        stream, motion, list(range(len(robot.joint_names))), list(range(len(robot.body_names))), motion.body_lin_vel_w
    )


def _isaac_npz(stream: IO[bytes], motion: Reference, robot: RobotModel, _name: str) -> None:
    """Isaac Lab's order, level by level; its linear velocities are those of the bodies' centres of mass."""
    m = robot.model
    joints = [robot.joint(j) for j in breadth_first(robot)]
    of_joint = {robot.joint(m.joint(k).name): robot.place_of_body[m.jnt_bodyid[k]] for k in range(1, m.njnt)}
    bodies = [0, *(int(of_joint[j]) for j in joints)]
    com = rot.rotate(motion.body_quat_w, np.array([m.body_ipos[b] for b in robot.body_ids]))
    _motion_npz(stream, motion, joints, bodies, motion.body_lin_vel_w + rot.cross(motion.body_ang_vel_w, com))


def _motion_npz(stream: IO[bytes], motion: Reference, joints: list[int], bodies: list[int], lin_vel: ndarray) -> None:
    arrays = {
        "joint_pos": motion.joint_pos[:, joints],
        "joint_vel": motion.joint_vel[:, joints],
        "body_pos_w": motion.body_pos_w[:, bodies],
        "body_quat_w": motion.body_quat_w[:, bodies],
        "body_lin_vel_w": lin_vel[:, bodies],
        "body_ang_vel_w": motion.body_ang_vel_w[:, bodies],
    }
    small: dict[str, Any] = {k: v.astype(np.float32) for k, v in arrays.items()}
    np.savez(stream, fps=np.array([motion.fps]), **small)


def _own(content: Mapping[str, Any]) -> dict[str, Any]:
    """Arrays of their own, not views of a larger one."""
    return {k: np.array(v) if isinstance(v, ndarray) else v for k, v in content.items()}


def _whole(fps: float) -> float | int:
    return int(fps) if fps == int(fps) else fps


LAYOUTS: dict[str, Layout] = {
    "unitree-csv": Layout(
        title="Unitree: no header, xyz, quaternion xyzw, joints", suffix=".csv", fps=30.0, write=_unitree_csv
    ),
    "gmr": Layout(title="GMR pickle", suffix=".pkl", fps=None, write=_gmr),
    "phc": Layout(title="PHC / ASAP / PBHC joblib pickle", suffix=".pkl", fps=None, write=_phc),
    "mujoco-npz": Layout(
        title="BeyondMimic motion.npz in MuJoCo's order (mjlab)", suffix=".npz", fps=None, write=_mujoco_npz
    ),
    "isaac-npz": Layout(title="BeyondMimic motion.npz in Isaac Lab's order", suffix=".npz", fps=None, write=_isaac_npz),
}
