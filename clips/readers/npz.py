"""NPZ: our references, BeyondMimic / mjlab motions, Isaac AMP and LocoMuJoCo motions, AMASS-like SMPL poses."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
from numpy import ndarray

from clips.clip import MIN_FRAMES, Clip, RobotClip
from clips.errors import ClipError
from clips.identify import (
    NamedMotion,
    NamelessMotion,
    breadth_first,
    check_against_bodies,
    check_against_velocities,
    choose_layout,
    in_root,
    joints_by_name,
    robot_clip,
)
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers import point_arrays, qpos_npz, smpl
from clips.readers.one_of_several import refuse_another
from clips.readers.rates import rate
from robot_models import RobotModel, forward_kinematics, load_robot
from robot_models.incoming import MAX_NAME, parsed, read_arrays
from robot_models.maths import rotation as rot

_SOME = 50  # frames whose bodies are held against their joints
_BODY_TOLERANCE = (
    5e-3  # float32 files of other tools reproduce their bodies to ~1e-4 m; the wrong order misses by > 0.1
)


def recognises(raw: RawFile) -> bool:
    """A zip archive that holds .npy members."""
    return raw.head.startswith(b"PK\x03\x04") and b".npy" in raw.data[:200]


def read(raw: RawFile, options: ReadOptions) -> Clip:
    """Read an archive by its keys.

    Raises:
        ClipError: broken archive, or no known set of keys.
    """
    arrays = read_arrays(raw.data, raw.name, expected="a whole .npz", error=ClipError)
    data = dict(qpos_npz.joints_apart(raw, arrays))
    if np.size(data.get("split_points", ())) <= 2:
        refuse_another(raw, options)
    if "pose_body" in data and "root_orient" in data and "poses" not in data:
        _need(raw, data, {"root_orient": 2, "pose_body": 2})
        data["poses"] = np.concatenate((data["root_orient"], data["pose_body"]), axis=1)
    if "poses" in data and "trans" in data:
        _need(raw, data, {"poses": 2, "trans": 2})
        return smpl.read(raw, data, options)
    if "posed_joints" in data:
        return point_arrays.read_kimodo(raw, data, options)
    if "dof_positions" in data and "body_positions" in data:
        return _isaac_amp(raw, data, options)
    if "joint_pos" in data and "body_pos_w" in data:
        return _motion(raw, data, options)
    if qpos_npz.recognises(data):
        return qpos_npz.read(raw, data, options)
    raise ClipError(
        raw.name,
        found=f"keys {', '.join(data)}",
        expected="poses + trans (AMASS), joint_pos + body_pos_w (BeyondMimic, ours) dof_positions (Isaac AMP), "
        "posed_joints (Kimodo) or qpos (LocoMuJoCo, OmniRetarget)",
    )


def _need(raw: RawFile, data: Mapping[str, ndarray], dims: Mapping[str, int]) -> None:
    """Refuse an archive that lacks a key, or has it in another shape, before anything is computed."""
    for key, ndim in dims.items():
        if key not in data:
            raise ClipError(raw.name, found=f"no key '{key}' among {', '.join(data)}", expected="the whole layout")
        array = data[key]
        if array.ndim != ndim or len({np.shape(data[k])[:1] for k, n in dims.items() if n > 1 and k in data}) > 1:
            raise ClipError(f"{raw.name}, {key}", found=f"shape {array.shape}", expected=f"{ndim} axes, frames first")
        if ndim > 1 and len(array) < MIN_FRAMES:
            raise ClipError(f"{raw.name}, {key}", found=f"{len(array)} frames", expected=f"at least {MIN_FRAMES}")
        if ndim > 1 and array.dtype.kind not in "fiu":
            raise ClipError(f"{raw.name}, {key}", found=f"{array.dtype} values", expected="numbers")


def _robot_of(raw: RawFile, data: Mapping[str, ndarray]) -> str:
    """The robot that a reference's metadata names."""
    where, expected = f"{raw.name}, meta", "a reference's meta, JSON that names a robot"
    meta = parsed(json.loads, str(data["meta"]), where, expected=expected, error=ClipError)
    robot = meta.get("robot") if isinstance(meta, dict) else None
    if not isinstance(robot, str) or not 0 < len(robot) <= MAX_NAME:
        raise ClipError(where, found="no JSON that names a robot", expected=expected)
    return robot


def _motion(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions) -> RobotClip:
    """BeyondMimic's keys: with names (ours), or without, when the order is found by forward kinematics."""
    _need(raw, data, {"joint_pos": 2, "body_pos_w": 3, "body_quat_w": 3})
    of_bodies = {key: (*data["body_pos_w"].shape[:2], n) for key, n in (("body_pos_w", 3), ("body_quat_w", 4))}
    for key, shape in of_bodies.items():
        if data[key].shape != shape or not data[key].size:
            raise ClipError(f"{raw.name}, {key}", found=f"shape {data[key].shape}", expected=f"{shape}, of some bodies")
    fps, finding = rate(raw, data, options, "fps")
    if "joint_names" in data and ("meta" in data or "body_names" in data):
        _need(raw, data, {"joint_names": 1} | ({"body_names": 1} if "body_names" in data else {}))
        names = tuple(map(str, data["joint_names"]))
        ours = "meta" in data
        robot = (options.source_robot or _robot_of(raw, data)) if ours else joints_by_name(raw, names, options)[0]
        order = Finding(what="joint order", value="by name", why="key 'joint_names'", confidence="stated")
        dialect = "reference of this project" if ours else "motion.npz with names (holosoma)"
        more = _held(raw, robot, names, data, ("joint_pos", "body_names", "body_pos_w", "body_quat_w"))
    else:
        data, more = _without_world(data)
        motion = NamelessMotion(
            root_pos=data["body_pos_w"][:, 0].astype(float), root_quat=data["body_quat_w"][:, 0].astype(float),
            joint_pos=data["joint_pos"].astype(float),
        )  # fmt: skip
        robot, depth_first, _ = choose_layout(raw, motion, options)
        names, order = _order_by_kinematics(raw, load_robot(robot), depth_first, data)
        dialect = "BeyondMimic motion.npz"
    more += _rate_held(raw, data, "joint_pos", "joint_vel", fps, options)
    return robot_clip(
        raw,
        dialect=dialect,
        fps=fps,
        robot=robot,
        joint_names=names,
        root_pos=np.asarray(data["body_pos_w"][:, 0], dtype=float),
        root_quat=np.asarray(data["body_quat_w"][:, 0], dtype=float),
        quat_order="wxyz",
        joint_pos=np.asarray(data["joint_pos"], dtype=float),
        options=options,
        findings=[finding, order, *more],
    )


def _held(
    raw: RawFile, robot: str, names: tuple[str, ...], data: Mapping[str, ndarray], keys: tuple[str, str, str, str]
) -> list[Finding]:
    """Hold named joints against named bodies; the first key is of the joints, the others of the bodies."""
    joints, body_names, positions, rotations = (data.get(key) for key in keys)
    if joints is None or body_names is None or positions is None or rotations is None:
        return []
    model, bodies = load_robot(robot), list(map(str, body_names))
    fits = set(names) <= set(model.joint_names) and model.body_names[0] in bodies and positions.shape[1] == len(bodies)
    if not fits or joints.shape[1] != len(names) or rotations.shape[:2] != positions.shape[:2]:
        return []  # refused where names and shapes are checked
    root = bodies.index(model.body_names[0])
    some = np.unique(np.linspace(0, len(joints) - 1, _SOME).astype(int))
    positions, rotations = positions[some].astype(float), rotations[some].astype(float)
    motion = NamedMotion(
        robot=model, joints=names, joint_pos=joints[some].astype(float), bodies=tuple(bodies),
        places=in_root(positions, rotations, root),
    )  # fmt: skip
    return [check_against_bodies(raw, motion)]


def _rate_held(
    raw: RawFile, data: Mapping[str, ndarray], positions: str, velocities: str, fps: float, options: ReadOptions
) -> list[Finding]:
    """Hold the file's velocities against its positions at its own rate; the user's is believed."""
    if options.fps is not None or velocities not in data or data[velocities].dtype.kind != "f":
        return []
    found = check_against_velocities(raw, data[positions], data[velocities], fps)
    return [] if found is None else [found]


def _without_world(data: Mapping[str, ndarray]) -> tuple[Mapping[str, ndarray], list[Finding]]:
    """mjlab's bodies may begin with MuJoCo's world, which stands at the origin in every frame."""
    pos, quat = data["body_pos_w"][:, 0], data["body_quat_w"][:, 0]
    if data["body_pos_w"].shape[1] < 2 or pos.any() or not np.array_equal(quat, np.tile(rot.IDENTITY, (len(quat), 1))):
        return data, []
    of_bodies = {key: value[:, 1:] for key, value in data.items() if key.startswith("body_") and value.ndim == 3}
    found = Finding(what="body 0", value="the world, left out", why="it never moves", confidence="measured")
    return {**data, **of_bodies}, [found]


def _order_by_kinematics(
    raw: RawFile, robot: RobotModel, depth_first: tuple[str, ...], data: Mapping[str, ndarray]
) -> tuple[tuple[str, ...], Finding]:
    """MuJoCo's depth-first or Isaac's breadth-first order, whichever reproduces the stored bodies."""
    frames = np.unique(np.linspace(0, len(data["joint_pos"]) - 1, 20).astype(int))
    stored = np.asarray(data["body_pos_w"], dtype=float)[frames]
    misses = {}
    isaac = tuple(n for n in breadth_first(robot) if n in depth_first)
    for label, names in (("MuJoCo depth-first", depth_first), ("Isaac breadth-first", isaac)):
        if stored.shape[1] != 1 + len(names):
            break
        qpos = np.tile(robot.default_qpos, (len(frames), 1))
        qpos[:, :3], qpos[:, 3:7] = stored[:, 0], data["body_quat_w"][frames, 0]
        qpos[:, [7 + robot.joint(n) for n in names]] = data["joint_pos"][frames]
        pos, _ = forward_kinematics(robot, qpos)
        joints = [robot.joint(n) for n in names]
        bodies = [0, *(1 + j for j in joints)]  # body i + 1 is moved by joint i in either order
        misses[label] = (float(np.abs(pos[:, bodies] - stored).max()), names)
    if misses:
        best = min(misses, key=lambda k: misses[k][0])
        others = ", ".join(f"{k} misses by {1000 * v[0]:.0f} mm" for k, v in misses.items() if k != best)
        if misses[best][0] < _BODY_TOLERANCE:
            why = f"forward kinematics reproduces body_pos_w to {1000 * misses[best][0]:.2g} mm; {others}"
            return misses[best][1], Finding(what="joint order", value=best, why=why, confidence="measured")
    found = ", ".join(f"{k} misses by {1000 * v[0]:.0f} mm" for k, v in misses.items()) or f"{stored.shape[1]} bodies"
    raise ClipError(
        raw.name, found=f"bodies that no joint order of {robot.name} reproduces ({found})",
        expected="body_pos_w that follows from joint_pos",
        cure="name the robot it was made for, or its profile (.toml)", option="source_robot",
    )  # fmt: skip


def _isaac_amp(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions) -> RobotClip:
    """Isaac AMP: named joints and bodies, both breadth-first; wxyz."""
    _need(raw, data, {"dof_positions": 2, "body_positions": 3, "body_rotations": 3, "dof_names": 1, "body_names": 1})
    fps, finding = rate(raw, data, options, "fps")
    names, bodies = tuple(map(str, data["dof_names"])), list(map(str, data["body_names"]))
    robot = options.source_robot or joints_by_name(raw, names, options)[0]
    root = load_robot(robot).body_names[0]
    if root not in bodies:
        raise ClipError(
            f"{raw.name}, body_names", found=", ".join(bodies[:4]) + " ...", expected=f"{robot}'s root '{root}'"
        )
    more = _held(raw, robot, names, data, ("dof_positions", "body_names", "body_positions", "body_rotations"))
    more += _rate_held(raw, data, "dof_positions", "dof_velocities", fps, options)
    return robot_clip(
        raw,
        dialect="Isaac AMP npz",
        fps=fps,
        robot=robot,
        joint_names=names,
        root_pos=np.asarray(data["body_positions"][:, bodies.index(root)], dtype=float),
        root_quat=rot.normalise(np.asarray(data["body_rotations"][:, bodies.index(root)], dtype=float)),
        quat_order="wxyz",
        joint_pos=np.asarray(data["dof_positions"], dtype=float),
        options=options,
        findings=[
            finding,
            Finding(what="joint order", value="by name", why="key 'dof_names'", confidence="stated"),
            *more,
        ],
    )
