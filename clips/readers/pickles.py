"""Pickles of the field (GMR, PHC / ASAP / PBHC through joblib, MimicKit, AIST++), opened without running a stranger's code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from clips.clip import MIN_FRAMES, Clip, HumanClip, RobotClip
from clips.errors import ClipError
from clips.identify import (
    NamedMotion,
    NamelessMotion,
    check_against_bodies,
    choose_layout,
    joint_order,
    joints_by_name,
    robot_clip,
)
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers import smpl, video_poses
from clips.readers.one_of_several import one_of_several, refuse_another
from clips.readers.unpickler import OPENERS, load
from robot_models import load_robot
from robot_models.maths import rotation as rot

_JOINT_NAMES = ("joint_names", "dof_names", "joints_names", "joint_order")
_BODY_NAMES = ("link_body_list", "body_names")
_ABSURD = 1e6  # no position, angle or quaternion of anybody


def recognises(raw: RawFile) -> bool:
    """A pickle of protocol 2 or later, bare or compressed by joblib."""
    return (raw.head[:1] == b"\x80" and raw.head[1:2] in b"\x02\x03\x04\x05") or raw.head.startswith(tuple(OPENERS))


def read(raw: RawFile, options: ReadOptions) -> Clip:
    """Read a pickle by the keys it holds.

    Raises:
        ClipError: it asks for code, or holds none of the known layouts.
    """
    return read_content(raw, load(raw), options)


def read_content(raw: RawFile, content: Any, options: ReadOptions) -> Clip:
    """Read what was unpacked, by the keys it holds.

    Raises:
        ClipError: none of the known layouts.
    """
    if isinstance(content, Mapping) and video_poses.recognises(content):
        return video_poses.read(raw, content, options)
    if isinstance(content, Mapping) and len(content) == 1 and isinstance(next(iter(content.values())), Mapping):
        one_of_several([str(next(iter(content)))], raw, replace(options, person=options.person or "1"))
        return _phc(raw, next(iter(content.values())), options)
    if isinstance(content, Mapping) and len(content) > 1 and all(isinstance(v, Mapping) for v in content.values()):
        place = one_of_several(list(map(str, content)), raw, options)
        return _one_clip(raw, list(content.values())[place], options)
    refuse_another(raw, options)
    return _one_clip(raw, content, options)


def _one_clip(raw: RawFile, content: Any, options: ReadOptions) -> Clip:
    """A clip by the keys that it has."""
    if isinstance(content, Mapping) and {"root_pos", "root_rot", "dof_pos"} <= set(content):
        return _gmr(raw, content, options)
    if isinstance(content, Mapping) and {"root_trans", "root_ori", "dof_pos"} <= set(content):
        return _phuma(raw, content, options)
    if isinstance(content, Mapping) and {"smpl_poses", "smpl_trans"} <= set(content):
        return _aist(raw, content, options)
    if isinstance(content, Mapping) and "frames" in content:
        return _mimickit(raw, content, options)
    if isinstance(content, Mapping) and "root_trans_offset" in content:
        return _phc(raw, content, options)
    keys = ", ".join(map(str, content)) if isinstance(content, Mapping) else type(content).__name__
    raise ClipError(
        raw.name,
        found=f"a pickle with {keys}",
        expected="GMR (root_pos, root_rot, dof_pos), PHC/ASAP/PBHC (root_trans_offset, dof), PHUMA (root_trans, root_ori), "
        "MimicKit (frames), AIST++ (smpl_poses, smpl_trans), or a result of GVHMR, WHAM, TRAM or 4D-Humans",
    )


def _gmr(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> RobotClip:
    return _joint_space(
        raw,
        "GMR pickle",
        content.get("fps"),
        content["root_pos"],
        content["root_rot"],
        "xyzw",
        content["dof_pos"],
        options,
        said=content,
    )


def _phuma(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> RobotClip:
    return _joint_space(
        raw, "PHUMA motion", content.get("fps"), content["root_trans"], content["root_ori"], "xyzw", content["dof_pos"],
        options, said=content,
    )  # fmt: skip


def _phc(raw: RawFile, content: Mapping[Any, Any], options: ReadOptions) -> RobotClip:
    missing = {"root_trans_offset", "root_rot", "dof"} - set(content)
    if missing:
        raise ClipError(
            raw.name,
            found=f"no {', '.join(sorted(missing))} among {', '.join(map(str, content))}",
            expected="a PHC/ASAP/PBHC clip",
        )
    return _joint_space(
        raw, "PHC/ASAP/PBHC pickle", content.get("fps"), content["root_trans_offset"], content["root_rot"], "xyzw",
        content["dof"], options, said=content,
    )  # fmt: skip


def _mimickit(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> RobotClip:
    frames = _numbers(raw, "frames", content["frames"])
    if frames.shape[1] < 7:
        raise ClipError(f"{raw.name}, frames", found=f"{frames.shape[1]} columns", expected="3 + 3 + joints")
    quat = rot.exp(frames[:, 3:6])
    return _joint_space(
        raw, "MimicKit pickle", content.get("fps"), frames[:, :3], quat, "wxyz", frames[:, 6:], options,
        said=content, conversions=["root rotation vector -> quaternion"],
    )  # fmt: skip


def _aist(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> HumanClip:
    """AIST++: SMPL poses, translation in units of `smpl_scaling`, no rate."""
    if options.fps is None:
        raise ClipError(
            raw.name, found="no frame rate: AIST++ files have none", expected="a stated one: AIST++ is at 60, EDGE's outputs at 30",
            cure="state it", option="fps", suggestion="60",
        )  # fmt: skip
    poses, trans = (_numbers(raw, key, content[key]) for key in ("smpl_poses", "smpl_trans"))
    try:
        scaling = np.asarray(content.get("smpl_scaling", 1.0), dtype=float).reshape(-1)
    except (TypeError, ValueError):
        scaling = np.zeros(0)
    if scaling.size != 1 or not scaling[0] > 0.0:
        raise ClipError(
            f"{raw.name}, smpl_scaling", found=_told(content["smpl_scaling"]), expected="one number above 0"
        )
    return smpl.read(raw, {"poses": poses, "trans": trans / scaling[0]}, options)


def _joint_space(
    raw: RawFile, dialect: str, fps: Any, pos: Any, quat: Any, order: str, dof: Any, options: ReadOptions, *,
    said: Mapping[str, Any], conversions: Sequence[str] = (),
) -> RobotClip:  # fmt: skip
    if fps is None and options.fps is None:
        raise raw.no_fps()
    try:
        rate = float(options.fps if options.fps is not None else np.asarray(fps, dtype=float).reshape(-1)[0])
    except (TypeError, ValueError, IndexError) as e:
        raise ClipError(f"{raw.name}, fps", found=_told(fps), expected="frames per second", option="fps") from e
    why = "given" if options.fps is not None else "key 'fps'"
    joints = _numbers(raw, "joint angles", dof)
    root_pos, root_quat = _numbers(raw, "root position", pos), _numbers(raw, "root rotation", quat)
    _check_root(raw, root_pos, root_quat, joints)
    written = _words(said, _JOINT_NAMES)
    if written:
        robot, names, orders = _by_name(raw, written, joints.shape[1], options)
    else:
        motion = NamelessMotion(root_pos=root_pos, root_quat=root_quat, joint_pos=joints)
        robot, names, finding = choose_layout(raw, motion, options)
        names, column_order = joint_order(raw, robot, names, root_pos, root_quat, joints, options)
        orders = [finding, column_order]
    bodies, places = _words(said, _BODY_NAMES), said.get("local_body_pos")
    if bodies and places is not None:
        orders.append(_checked_bodies(raw, robot, names, joints, bodies, places))
    return robot_clip(
        raw,
        dialect=dialect,
        fps=rate,
        robot=robot,
        joint_names=names,
        root_pos=root_pos,
        root_quat=root_quat,
        quat_order=order,
        joint_pos=joints,
        options=options,
        findings=[
            Finding(what="fps", value=f"{rate:.6g}", why=why, confidence="stated", option="fps"),
            *orders,
        ],
        conversions=conversions,
    )


def _by_name(
    raw: RawFile, written: list[str], count: int, options: ReadOptions
) -> tuple[str, tuple[str, ...], list[Finding]]:
    """Robot and joint names of a file that names its columns."""
    if len(written) != count:
        raise ClipError(
            f"{raw.name}, names of joints", found=f"{len(written)} names for {count} columns", expected="one for each"
        )
    robot, names = joints_by_name(raw, written, options)
    order = Finding(what="joint order", value="by name", why="the file names its joints", confidence="stated")
    return robot, names, [order]


def _checked_bodies(
    raw: RawFile, robot: str, names: Sequence[str], joints: ndarray, bodies: list[str], places: Any
) -> Finding:
    """GMR's `local_body_pos`: origins of the bodies in the pelvis' frame."""
    try:
        array = np.asarray(places, dtype=float)
    except (TypeError, ValueError) as e:
        raise ClipError(f"{raw.name}, local_body_pos", found=f"no numbers ({e})", expected="places of bodies") from e
    if array.shape != (len(joints), len(bodies), 3):
        raise ClipError(
            f"{raw.name}, local_body_pos", found=f"shape {array.shape} for {len(joints)} frames and {len(bodies)} names",
            expected="one place for each",
        )  # fmt: skip
    motion = NamedMotion(
        robot=load_robot(robot), joints=tuple(names), joint_pos=joints, bodies=tuple(bodies), places=array
    )
    return check_against_bodies(raw, motion)


def _words(said: Mapping[str, Any], keys: tuple[str, ...]) -> list[str]:
    """The names under the first of some keys that holds any."""
    for key in keys:
        value = said.get(key)
        if (
            isinstance(value, list | tuple | np.ndarray)
            and np.ndim(value) == 1
            and all(isinstance(v, str) for v in value)
        ):
            return [str(v) for v in value]
    return []


def _check_root(raw: RawFile, pos: ndarray, quat: ndarray, joints: ndarray) -> None:
    if pos.shape[1:] != (3,) or quat.shape[1:] != (4,) or not MIN_FRAMES <= len(pos) == len(quat) == len(joints):
        raise ClipError(
            raw.name, found=f"root positions {pos.shape}, rotations {quat.shape} and joints {joints.shape}",
            expected="frames by 3, 4 and joints",
        )  # fmt: skip


def _numbers(raw: RawFile, what: str, value: Any) -> ndarray:
    try:
        with np.errstate(all="ignore"):  # a signalling NaN in float32
            array = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as e:
        raise ClipError(f"{raw.name}, {what}", found=f"no numbers ({e})", expected="a table of numbers") from e
    if array.ndim == 3 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim != 2:
        raise ClipError(f"{raw.name}, {what}", found=f"an array of shape {array.shape}", expected="frames by columns")
    if not (np.abs(array) < _ABSURD).all():
        raise ClipError(
            f"{raw.name}, {what}", found="numbers that are not finite, or absurd", expected="metres and radians"
        )
    return array


def _told(value: Any) -> str:
    """A stranger's value in a message; nested too deep, it has no text."""
    try:
        return f"{value!r:.80}"
    except RecursionError:
        return f"a {type(value).__name__} nested without end"
