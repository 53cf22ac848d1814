"""The file of a reference, `*.npz` of format version 1 (docs/formats.md): written whole, and doubted when it is read.

The first seven keys are those of mjlab's and BeyondMimic's `motion.npz` in MuJoCo order, so that their trackers load the
file unchanged. A reader holds velocities against positions, and bodies against the forward kinematics of the joints.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from clips.errors import ReferenceFileError
from clips.files import write_whole
from clips.provenance import FASTEST, SLOWEST
from clips.reference import MOTION, Reference
from robot_models import CONTACT_NAMES, PART_NAMES, RobotModel, forward_kinematics
from robot_models.incoming import MAX_NAME, parsed, read_arrays
from robot_models.maths import rotation as rot

FORMAT_VERSION, _READ = 2, (1, 2)  # the second knows edges that glide
_TOLERANCE = {"float64": 1e-9, "float32": 1e-5}  # of stored body poses against forward kinematics [m, rad]
_CONVENTIONS = {"units": "m, rad, s", "quaternion_order": "wxyz", "world_frame": "right-handed, z up"}
_KEYS = ("fps", *MOTION, "joint_names", "body_names", "contact", "contact_names", "segments", "meta")
_MOST_TORQUE = 10.0  # efforts: the hardest of 379 references that were measured asks for 3.5
_FEWEST = 3  # frames: central differences need a neighbour on both sides


def save_reference(reference: Reference, path: Path | str, *, float32: bool = False) -> None:
    """Write the file whole or not at all.

    Raises:
        DanceError: the folder is absent, read-only or full.
    """
    kind = np.float32 if float32 else np.float64
    meta = {
        "format_version": FORMAT_VERSION,
        **_CONVENTIONS,
        "robot": reference.robot,
        "robot_hash": reference.robot_hash,
        **reference.meta,
    }
    arrays = {k: getattr(reference, k).astype(kind) for k in (*MOTION, *reference.optional)}
    if reference.part_contact is not None:
        arrays |= {"part_contact": reference.part_contact, "part_names": np.array(PART_NAMES)}
    with write_whole(Path(path)) as stream:
        np.savez(
            stream,
            fps=np.array([reference.fps]),
            **arrays,
            joint_names=np.array(reference.joint_names),
            body_names=np.array(reference.body_names),
            contact=reference.contact,
            contact_names=np.array(CONTACT_NAMES),
            segments=reference.segments,
            meta=np.array(json.dumps(meta, ensure_ascii=False, sort_keys=True)),
        )


def is_reference(path: Path) -> bool:
    """Whether a file says that it is a reference of this project, by the names of its arrays."""
    try:
        with zipfile.ZipFile(path) as archive:
            return {"meta.npy", "contact.npy", "segments.npy"} <= set(archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False


def load_reference(path: Path | str, robot: RobotModel | None = None) -> Reference:
    """Read a reference file; with the robot at hand, check it against the robot's forward kinematics.

    Raises:
        ReferenceFileError: not such a file, a later format, names missing, or numbers that contradict each other.
    """
    path, where = Path(path), str(path)
    data = _read_arrays(path)
    meta = _meta(data, where)
    for key in ("contact", "segments", "part_contact"):
        if key in data and data[key].dtype.kind not in "iu":
            raise ReferenceFileError(f"{where}, {key}", found=f"{data[key].dtype} values", expected="whole numbers")
    if tuple(_names(data, "contact_names", where)) != CONTACT_NAMES:
        raise ReferenceFileError(
            where, found=f"contact names {list(data['contact_names'])[:4]}", expected=f"{list(CONTACT_NAMES)}"
        )
    if "part_contact" in data and ("part_names" not in data or _names(data, "part_names", where) != PART_NAMES):
        raise ReferenceFileError(f"{where}, part_names", found="other names or none", expected=f"{list(PART_NAMES)}")
    reference = Reference(
        robot=meta["robot"],
        robot_hash=meta["robot_hash"],
        fps=_fps(data, where),
        joint_names=_names(data, "joint_names", where),
        body_names=_names(data, "body_names", where),
        **{k: data[k] for k in MOTION},
        contact=data["contact"],
        segments=data["segments"],
        meta={k: v for k, v in meta.items() if k not in _STATED},
        joint_torque=data.get("joint_torque"),
        part_contact=data.get("part_contact"),
    )
    if robot is not None:
        check_reference_against(reference, robot, where)
    _check_velocities(reference, where)
    return reference


_STATED = ("format_version", "units", "quaternion_order", "world_frame", "robot", "robot_hash")


def _read_arrays(path: Path) -> dict[str, ndarray]:
    arrays = read_arrays(path, str(path), expected="a reference made by this project (.npz)", error=ReferenceFileError)
    missing = [k for k in _KEYS if k not in arrays]
    if missing:
        raise ReferenceFileError(
            str(path), found=f"no key {', '.join(missing)}", expected="a reference made by this project",
            cure="make one from the clip with dance-retarget",
        )  # fmt: skip
    flat = [
        k
        for k in (*_KEYS, "joint_torque", "part_contact")
        if k in arrays and k not in ("fps", "meta") and not arrays[k].ndim
    ]
    if flat or arrays["meta"].dtype.kind != "U":
        found = f"single values for {', '.join(flat)}" if flat else f"{arrays['meta'].dtype} for meta"
        raise ReferenceFileError(str(path), found=found, expected="arrays by frame, and words")
    return arrays


def _meta(data: Mapping[str, ndarray], where: str) -> dict[str, Any]:
    """The JSON entry: robot, hash, and what else was noted."""
    expected = "the metadata of a reference, as JSON"
    meta = parsed(json.loads, str(data["meta"]), f"{where}, meta", expected=expected, error=ReferenceFileError)
    if not isinstance(meta, dict) or type(meta.get("format_version")) is not int or meta["format_version"] not in _READ:
        version = meta.get("format_version") if isinstance(meta, dict) else "none"
        raise ReferenceFileError(
            where, found=f"format version {version!r}"[:80], expected=f"version {' or '.join(map(str, _READ))}",
            cure="use the release that wrote it, or retarget the clip again",
        )  # fmt: skip
    kinds = {"robot": str, "robot_hash": str, "source": dict, "report": dict, "segment_names": list, "config": dict}
    for key, kind in kinds.items():
        required = key in ("robot", "robot_hash")
        if (required or key in meta) and not isinstance(meta.get(key), kind):
            raise ReferenceFileError(
                f"{where}, meta, {key}", found=repr(meta.get(key))[:60], expected=f"a {kind.__name__}"
            )
    for key, value in _CONVENTIONS.items():
        if meta.get(key, value) != value:
            raise ReferenceFileError(f"{where}, meta, {key}", found=repr(meta[key])[:60], expected=value)
    source = meta.get("source", {}).get("file", "")
    if not isinstance(source, str) or len(source) > MAX_NAME or source != Path(source).name or "\0" in source:
        raise ReferenceFileError(f"{where}, meta, source", found=repr(source)[:60], expected="the name of a file")
    words = (meta["robot"], *meta.get("segment_names", ()))
    if not all(isinstance(word, str) and len(word) <= MAX_NAME and word.isprintable() for word in words):
        raise ReferenceFileError(
            f"{where}, meta, robot, segment_names", found=repr(words)[:60], expected="printable words"
        )
    if len(meta.get("segment_names", ())) not in (0, len(data["segments"])):
        found = f"{len(meta['segment_names'])} of {len(data['segments'])} segments"
        raise ReferenceFileError(f"{where}, meta, segment_names", found=found, expected="a name for each, or none")
    for metric in meta.get("report", {}).values():
        if not isinstance(metric, dict) or not isinstance(metric.get("passed"), bool):
            raise ReferenceFileError(
                f"{where}, meta, report", found=repr(metric)[:60], expected="value and passed of a metric"
            )
    return meta


def _names(data: Mapping[str, ndarray], key: str, where: str) -> tuple[str, ...]:
    names = data[key]
    if (
        names.ndim != 1
        or names.dtype.kind != "U"
        or any(not 0 < len(n) <= MAX_NAME or not n.isprintable() for n in names)
    ):
        raise ReferenceFileError(
            f"{where}, {key}",
            found=f"{names.dtype} of shape {names.shape}",
            expected=f"words of 1 to {MAX_NAME} characters",
        )
    return tuple(map(str, names))


def _fps(data: Mapping[str, ndarray], where: str) -> float:
    rate = data["fps"]
    if rate.size != 1 or rate.dtype.kind not in "fiu" or not SLOWEST <= float(rate.reshape(())) <= FASTEST:
        raise ReferenceFileError(
            f"{where}, fps", found=str(rate)[:60], expected=f"one number from {SLOWEST:g} to {FASTEST:g}",
            cure="retarget the clip again",
        )  # fmt: skip
    return float(rate.reshape(()))


def _check_velocities(reference: Reference, where: str) -> None:
    """Hold every velocity against the positions' central differences, by which they were made."""
    dt, r = 1.0 / reference.fps, reference
    if r.frames < _FEWEST:
        raise ReferenceFileError(f"{where}, joint_pos", found=f"{r.frames} frames", expected=f"{_FEWEST} at least")
    if ((r.body_quat_w[1:] * r.body_quat_w[:-1]).sum(axis=-1) < 0.0).any():
        found = "quaternions that change their sign between two frames"
        raise ReferenceFileError(f"{where}, body_quat_w", found=found, expected="the nearer of the two signs")
    digits = np.finfo(np.float32 if r.joint_pos.dtype == np.float32 else np.float64).eps
    made = {
        "joint_vel": (r.joint_pos, rot.linear_velocity),
        "body_lin_vel_w": (r.body_pos_w, rot.linear_velocity),
        "body_ang_vel_w": (r.body_quat_w, rot.angular_velocity),
    }
    for name, (positions, velocity) in made.items():
        there = getattr(r, name)
        apart = np.abs(there - velocity(np.asarray(positions, dtype=float), dt)).reshape(r.frames, -1).max(axis=1)
        # The ends have one neighbour: of a part of a motion their velocity was that of the whole, a step away at most.
        apart[[0, -1]] -= np.abs(np.diff(there, axis=0)).max()
        off, scale = float(apart.max()), max(1.0, float(np.abs(positions).max())) / dt + float(np.abs(there).max())
        if not off <= 1e-7 + 16.0 * digits * scale:
            raise ReferenceFileError(
                f"{where}, {name}", found=f"velocities {off:.2g} off the differences of the positions",
                expected="the same", cure="the file was edited or mixed: retarget the clip again",
            )  # fmt: skip


def check_reference_against(reference: Reference, robot: RobotModel, where: str) -> None:
    """Hold a reference against a robot's names, hash and forward kinematics; `where` is for the message.

    Raises:
        ReferenceFileError: they contradict each other.
    """
    if reference.joint_names != robot.joint_names or reference.body_names != robot.body_names:
        odd = [
            n
            for n in (*reference.joint_names, *reference.body_names)
            if n not in (*robot.joint_names, *robot.body_names)
        ]
        raise ReferenceFileError(
            where, found=f"names or order that are not {robot.name}'s ({', '.join(odd[:5]) or 'another order'})",
            expected=f"{robot.name}'s {len(robot.joint_names)} joints and {len(robot.body_names)} bodies",
        )  # fmt: skip
    if reference.robot != robot.name:
        raise ReferenceFileError(where, found=f"a reference of '{reference.robot}'", expected=f"one of {robot.name}")
    if reference.robot_hash != robot.hash:
        raise ReferenceFileError(
            where, found=f"robot hash {reference.robot_hash[:12]}", expected=f"{robot.hash[:12]} of '{robot.name}' as it is now",
            cure="the robot changed since: retarget the clip again",
        )  # fmt: skip
    pos, quat = forward_kinematics(robot, reference.qpos)
    tolerance = _TOLERANCE["float32" if reference.joint_pos.dtype == np.float32 else "float64"]
    off = float(np.abs(pos - reference.body_pos_w).max())
    turned = float(rot.angle_between(quat, rot.normalise(reference.body_quat_w)).max())
    if off > tolerance or turned > 10 * tolerance:
        raise ReferenceFileError(
            where, found=f"bodies {off:.2g} m and {turned:.2g} rad away from the forward kinematics of the joints",
            expected=f"at most {tolerance:g} m", cure="the file was edited or mixed: retarget the clip again",
        )  # fmt: skip
    if reference.joint_torque is not None and (np.abs(reference.joint_torque) > _MOST_TORQUE * robot.effort).any():
        worst = float((np.abs(reference.joint_torque) / robot.effort).max())
        raise ReferenceFileError(
            f"{where}, joint_torque", found=f"{worst:.3g} times what a motor has", expected=f"at most {_MOST_TORQUE:g}",
            cure="the file was edited or mixed: retarget the clip again",
        )  # fmt: skip
