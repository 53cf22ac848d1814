"""References in few bits, for a teacher to rehearse what it knows: every other frame, 16 bits a number, no bodies.

What is left out follows: bodies and velocities by forward kinematics, the frames between by a cubic spline. On references
of the project that is right to a few milliradians, which is less than robots are drawn apart.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.interpolate import CubicSpline

from clips import make_reference, write_whole
from robot_models import CONTACT_NAMES, RobotModel
from robot_models.maths import rotation as rot
from tracking.errors import TrackingError
from tracking.task.motion_set import NamedReference

FORMAT_VERSION, _STRIDE = 1, 2


def write_rehearsal_set(path: Path, pieces: Sequence[NamedReference], credits: str) -> None:
    """Write references of one robot and rate into one small file.

    Args:
        path: `.npz`.
        pieces: the references.
        credits: whose motions they are, and under which licences.
    """
    first = pieces[0].reference
    told = {
        "format_version": FORMAT_VERSION, "robot": first.robot, "robot_hash": first.robot_hash, "fps": first.fps,
        "names": [p.name for p in pieces], "frames": [p.reference.frames for p in pieces], "credits": credits,
        "segment_names": [list(p.reference.meta.get("segment_names", ())) for p in pieces],
    }  # fmt: skip
    poses = _packed(np.concatenate([_kept(p.reference.qpos) for p in pieces]), np.int16)
    torques = _packed(np.concatenate([_kept(_torque(p)) for p in pieces]), np.int8)
    segments = np.concatenate([p.reference.segments for p in pieces])
    counts = [len(p.reference.segments) for p in pieces]
    tables: dict[str, Any] = {
        "segments": segments,
        "segment_counts": np.array(counts),
        "meta": np.array(json.dumps(told)),
    }
    tables |= {f"pose_{k}": v for k, v in poses.items()} | {f"torque_{k}": v for k, v in torques.items()}
    with write_whole(path) as stream:
        np.savez_compressed(stream, **tables)


def rehearsal_names(path: Path) -> list[str]:
    """The names of the references in such a file; raises as `read_rehearsal_set`."""
    with _reading(path), np.load(path, allow_pickle=False) as file:
        return list(_told(file)["names"])


def read_rehearsal_set(path: Path, robot: RobotModel, only: Collection[str] = ()) -> list[NamedReference]:
    """References from such a file, whole again.

    Args:
        path: the file.
        robot: whose motions they are.
        only: the names of those to read; all where there are none.

    Raises:
        TrackingError: not such a file, or another robot's.
    """
    with _reading(path):
        with np.load(path, allow_pickle=False) as file:
            data = dict(file)
        told = _told(data)
        poses, torques = (_unpacked({k: data[f"{name}_{k}"] for k in _PARTS}) for name in ("pose", "torque"))
    if told["robot_hash"] != robot.hash:
        raise TrackingError(str(path), found=f"motions of {told['robot']}", expected=f"{robot.name} as it is now")
    kept = np.cumsum([0, *(len(_places(frames)) for frames in told["frames"])])
    parts = np.cumsum([0, *data["segment_counts"]])
    out = []
    for i, (name, frames) in enumerate(zip(told["names"], told["frames"], strict=True)):
        if only and name not in only:
            continue
        qpos = _between(poses[kept[i] : kept[i + 1]], frames)
        qpos[:, 3:7] = rot.normalise(qpos[:, 3:7])
        bare = make_reference(
            robot, qpos, told["fps"], contact=np.zeros((frames, len(CONTACT_NAMES)), dtype=np.int8),
            segments=data["segments"][parts[i] : parts[i + 1]],
            meta={"source": {"file": f"{path.name}: {name}"}, "segment_names": told["segment_names"][i]},
        )  # fmt: skip
        whole = replace(bare, joint_torque=_between(torques[kept[i] : kept[i + 1]], frames))
        out.append(NamedReference(name=name, reference=whole, path=path, sha256=""))
    return out


_PARTS = ("steps", "low", "width")


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, KeyError, ValueError) as e:
        raise TrackingError(
            str(path), found=f"no rehearsal set ({e})", expected=f"one of version {FORMAT_VERSION}"
        ) from e


def _told(data: Mapping[str, ndarray]) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(str(data["meta"]))
    if told["format_version"] != FORMAT_VERSION:
        raise ValueError(f"format {told['format_version']}")
    return told


def _torque(piece: NamedReference) -> Float[ndarray, "T J"]:
    torque = piece.reference.joint_torque
    return np.zeros_like(piece.reference.joint_pos) if torque is None else torque


def _places(frames: int) -> ndarray:
    """Which frames are kept: every other one, and the last."""
    return np.unique(np.append(np.arange(0, frames, _STRIDE), frames - 1))


def _kept(table: Float[ndarray, "T K"]) -> Float[ndarray, "t K"]:
    return np.asarray(table)[_places(len(table))]


def _between(table: Float[ndarray, "t K"], frames: int) -> Float[ndarray, "T K"]:
    return np.asarray(CubicSpline(_places(frames), table)(np.arange(frames)))


def _packed(table: Float[ndarray, "t K"], kind: type) -> dict[str, ndarray]:
    """Whole numbers of equal steps between each column's smallest and largest value."""
    low, width = table.min(axis=0), np.maximum(np.ptp(table, axis=0), 1e-9)
    info = np.iinfo(kind)
    steps = np.round(info.min + (table - low) / width * (info.max - info.min)).astype(kind)
    return {"steps": steps, "low": low, "width": width}


def _unpacked(parts: dict[str, ndarray]) -> Float[ndarray, "t K"]:
    info = np.iinfo(parts["steps"].dtype)
    share = (parts["steps"].astype(float) - info.min) / (info.max - info.min)
    return np.asarray(parts["low"] + share * parts["width"])
