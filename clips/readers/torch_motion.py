"""What torch saved, opened by its own loader of plain tensors: ProtoMotions' `.motion`, GVHMR's results."""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np

from clips.clip import Clip, RobotClip
from clips.errors import ClipError
from clips.identify import NamelessMotion, choose_layout, joint_order, robot_clip
from clips.provenance import RawFile, ReadOptions
from clips.readers import video_poses
from clips.readers.rates import rate
from robot_models import import_or_refuse
from robot_models.incoming import refuse_bombs
from robot_models.maths import rotation as rot

_KEYS = ("dof_pos", "rigid_body_pos", "rigid_body_rot")


def recognises(raw: RawFile) -> bool:
    """A zip archive with torch's pickle in it."""
    return raw.head.startswith(b"PK\x03\x04") and b"/data.pkl" in raw.data[:200]


def read(raw: RawFile, options: ReadOptions) -> Clip:
    """Read tensors by the keys they stand under.

    Raises:
        ClipError: torch is not installed, the file wants more than tensors, or holds another layout.
    """
    content = _tensors(raw)
    if video_poses.recognises(content):
        return video_poses.read(raw, content, options)
    return _proto_motion(raw, {k: v for k, v in content.items() if isinstance(v, np.ndarray)}, options)


def _proto_motion(raw: RawFile, data: dict[str, Any], options: ReadOptions) -> RobotClip:
    """Joints and the root's pose; the other bodies follow from them."""
    missing = [k for k in _KEYS if k not in data]
    if missing:
        raise ClipError(
            raw.name,
            found=f"no {', '.join(missing)} among {', '.join(data)}",
            expected="ProtoMotions' motion, or GVHMR's results",
        )
    joints, pos, quat = (data[k] for k in _KEYS)
    if not (
        joints.ndim == 2 and pos.shape[2:] == (3,) and quat.shape[2:] == (4,) and len(joints) == len(pos) == len(quat)
    ):
        raise ClipError(
            raw.name, found=f"joints {joints.shape}, bodies {pos.shape} and {quat.shape}",
            expected="frames by joints, by bodies and 3, by bodies and 4",
        )  # fmt: skip
    fps, finding = rate(raw, data, options, "fps")
    motion = NamelessMotion(root_pos=pos[:, 0], root_quat=quat[:, 0], joint_pos=joints)
    robot, names, layout = choose_layout(raw, motion, options)
    root = rot.from_quat_xyzw(quat[:, 0])
    names, order = joint_order(raw, robot, names, pos[:, 0], quat[:, 0], joints, options)
    return robot_clip(
        raw,
        dialect="ProtoMotions motion",
        fps=fps,
        robot=robot,
        joint_names=names,
        root_pos=pos[:, 0],
        root_quat=root,
        quat_order="wxyz",
        joint_pos=joints,
        options=options,
        findings=[finding, layout, order],
        conversions=["root quaternion xyzw -> wxyz"],
    )


def _torch(raw: RawFile) -> Any:
    cure = "pip install torch==2.13.0"
    refusal = ClipError(raw.name, found="no torch on this machine", expected="it, to open what it saved", cure=cure)
    return import_or_refuse("torch", refusal)


def _tensors(raw: RawFile) -> dict[str, Any]:
    """Every tensor and number of the file as arrays, in the dictionaries that they stand in."""
    torch = _torch(raw)
    try:
        with zipfile.ZipFile(io.BytesIO(raw.data)) as archive:
            refuse_bombs(archive, raw.name, ClipError)
        content = torch.load(io.BytesIO(raw.data), map_location="cpu", weights_only=True)
        if not isinstance(content, dict):
            shape = f" of shape {tuple(content.shape)}" if isinstance(content, torch.Tensor) else ""
            raise ClipError(
                raw.name,
                found=f"a bare {type(content).__name__}{shape}",
                expected="a dictionary of tensors, named by their keys",
            )
        return _arrays(content, torch.Tensor)
    except ClipError:
        raise
    except Exception as e:  # torch names what it will not load in errors of every kind
        raise ClipError(
            raw.name, found=f"a file that torch does not open as plain tensors ({str(e).splitlines()[0]:.120})",
            expected="a dictionary of tensors",
        ) from e  # fmt: skip


def _arrays(content: Any, tensor: type) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, dict):
            found[str(key)] = _arrays(value, tensor)
        elif isinstance(value, (tensor, int, float)) and not isinstance(value, bool):
            found[str(key)] = np.asarray(value, dtype=float)
    return found
