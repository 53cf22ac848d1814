"""Archives with MuJoCo's whole `qpos`: LocoMuJoCo's trajectories, OmniRetarget's results, holosoma's motions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy import ndarray

from clips.clip import MIN_FRAMES, RobotClip
from clips.errors import ClipError
from clips.identify import NamelessMotion, choose_layout, joint_order, joints_by_name, robot_clip
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers.one_of_several import one_of_several
from clips.readers.rates import rate

_ROOT = 7  # numbers of a free joint
_UNIT = 1e-2  # how far a quaternion's length may be off


def recognises(data: Mapping[str, ndarray]) -> bool:
    """Whether an archive holds `qpos`."""
    return "qpos" in data


def read(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions) -> RobotClip:
    """A robot's motion: joints by name, or in the order of the robot with so many.

    Raises:
        ClipError: another shape, no rate, several trajectories and none asked for, no free root in it.
    """
    qpos = data["qpos"]
    if qpos.ndim != 2 or len(qpos) < MIN_FRAMES or qpos.shape[1] <= _ROOT or qpos.dtype.kind not in "fiu":
        raise ClipError(
            f"{raw.name}, qpos",
            found=f"shape {qpos.shape}, {qpos.dtype}",
            expected="frames by 7 and a column per joint",
        )
    fps, finding = rate(raw, data, options, "frequency", "fps")
    data = _one_trajectory(raw, data, options)
    if "joint_names" in data:
        return _by_name(raw, data, options, fps, finding)
    return _by_order(raw, np.asarray(data["qpos"], dtype=float), options, fps, finding)


def joints_apart(raw: RawFile, data: Mapping[str, ndarray]) -> Mapping[str, ndarray]:
    """holosoma's `joint_pos` is the whole qpos: with as many columns as names and a root, its joints are taken out.

    Raises:
        ClipError: a root in it that is not the first body's.
    """
    names, joints, bodies = data.get("joint_names"), data.get("joint_pos"), data.get("body_names")
    if (
        names is None
        or joints is None
        or bodies is None
        or "meta" in data
        or not {"body_pos_w", "joint_vel"} <= set(data)
    ):
        return data
    if joints.ndim != 2 or joints.shape[1] != _ROOT + np.size(names):
        return data
    listed = [str(b) for b in np.reshape(bodies, -1)]
    keep = np.array([k for k, name in enumerate(listed) if name != "world"], dtype=int)
    positions = data["body_pos_w"]
    if positions.ndim != 3 or positions.shape[:2] != (len(joints), len(listed)) or not len(keep):
        raise ClipError(
            f"{raw.name}, body_pos_w", found=f"shape {positions.shape}", expected="frames by body_names by 3"
        )
    if not np.abs(positions[:, keep[0]] - joints[:, :3]).max() < _UNIT:
        raise ClipError(
            f"{raw.name}, joint_pos",
            found="a root that is not where its first body is",
            expected="qpos, the root first",
        )
    of_bodies = {k: v[:, keep] for k, v in data.items() if k.startswith("body_") and v.ndim == 3}
    return {
        **data, **of_bodies, "joint_pos": joints[:, _ROOT:], "joint_vel": data["joint_vel"][:, _ROOT - 1 :],
        "body_names": np.array(listed)[keep],
    }  # fmt: skip


def _by_order(raw: RawFile, qpos: ndarray, options: ReadOptions, fps: float, rate_finding: Finding) -> RobotClip:
    """OmniRetarget's results and their like: a position and a quaternion wxyz in either order, then joints without names."""
    lengths = {
        "position, then quaternion": np.linalg.norm(qpos[:, 3:7], axis=1),
        "quaternion, then position": np.linalg.norm(qpos[:, :4], axis=1),
    }
    fits = [how for how, length in lengths.items() if np.abs(length - 1.0).max() < _UNIT]
    if len(fits) != 1:
        raise ClipError(
            f"{raw.name}, qpos", found=f"{len(fits)} places for a unit quaternion among its first 7 columns",
            expected="position and quaternion of a free root",
        )  # fmt: skip
    first = fits[0] == "position, then quaternion"
    root_pos, root_quat = (qpos[:, :3], qpos[:, 3:7]) if first else (qpos[:, 4:7], qpos[:, :4])
    root = Finding(what="root", value=fits[0], why="where its numbers have length 1", confidence="measured")
    joints = qpos[:, _ROOT:]
    motion = NamelessMotion(root_pos=root_pos, root_quat=root_quat, joint_pos=joints)
    robot, names, layout = choose_layout(raw, motion, options)
    names, order = joint_order(raw, robot, names, root_pos, root_quat, joints, options)
    return robot_clip(
        raw, dialect="qpos archive", fps=fps, robot=robot, joint_names=names, root_pos=root_pos, root_quat=root_quat,
        quat_order="wxyz", joint_pos=joints, options=options, findings=[rate_finding, root, layout, order],
    )  # fmt: skip


def _one_trajectory(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions) -> Mapping[str, ndarray]:
    """The trajectory that is asked for, of several in one file."""
    if np.size(data.get("split_points", ())) <= 2:
        return data
    ends = np.asarray(data["split_points"])
    if (
        ends.dtype.kind not in "iu"
        or ends[0] != 0
        or ends[-1] != len(data["qpos"])
        or (np.diff(ends) < MIN_FRAMES).any()
    ):
        raise ClipError(
            f"{raw.name}, split_points", found=str(ends.tolist())[:60],
            expected=f"frame numbers from 0 to {len(data['qpos'])}, {MIN_FRAMES} frames apart at least",
        )  # fmt: skip
    names = [f"trajectory {k + 1}" for k in range(len(ends) - 1)]
    k = one_of_several(names, raw, options)
    return {**data, "qpos": data["qpos"][int(ends[k]) : int(ends[k + 1])]}


def _by_name(
    raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions, fps: float, finding: Finding
) -> RobotClip:
    """LocoMuJoCo's trajectory: qpos in MuJoCo's layout, the free joint first, joints by name."""
    free, *names = map(str, np.reshape(data["joint_names"], -1))
    if data["qpos"].shape[1] != 7 + len(names):
        raise ClipError(
            f"{raw.name}, qpos", found=f"{data['qpos'].shape[1]} columns for {free} and {len(names)} joints",
            expected=f"{7 + len(names)}: a free root and one per joint",
        )  # fmt: skip
    robot, joints = joints_by_name(raw, names, options)
    qpos = np.asarray(data["qpos"], dtype=float)
    return robot_clip(
        raw,
        dialect="LocoMuJoCo trajectory",
        fps=fps,
        robot=robot,
        joint_names=joints,
        root_pos=qpos[:, :3],
        root_quat=qpos[:, 3:7],
        quat_order="wxyz",
        joint_pos=qpos[:, 7:],
        options=options,
        findings=[finding, Finding(what="joint order", value="by name", why="key 'joint_names'", confidence="stated")],
    )
