"""`Clip`: what was recorded. Either a person (named points) or a robot (root pose and named joints)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.provenance import Provenance
from robot_models import RobotModel

REQUIRED = tuple(f"{s}_{p}" for s in ("left", "right") for p in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist"))
OPTIONAL = ("pelvis", "chest", "neck", "head", "left_toe", "right_toe")
MIN_FRAMES = 3


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class HumanClip:
    """Named points of a person in a right-handed, z-up world. T frames, K points."""

    fps: float
    names: tuple[str, ...]
    positions: Float[ndarray, "T K 3"]  # [m]
    orientations: Float[ndarray, "T K 4"] | None  # wxyz, world_from_point, where the file has them
    parents: tuple[int, ...]  # index of the parent point, -1 for a root
    landmarks: Mapping[str, str]  # "left_knee" -> point name; REQUIRED always, OPTIONAL where found
    height: float  # stature of the person [m]
    source: Provenance
    upright: bool = False  # orientations are already identity for someone who stands upright facing +x

    def __post_init__(self) -> None:
        _check_time(self)
        _check_names(self, self.names)
        points = (len(self.positions), len(self.names))
        _check_shape(self, "positions", self.positions, (*points, 3))
        if self.orientations is not None:
            _check_shape(self, "orientations", self.orientations, (*points, 4))
        _freeze(self, positions=self.positions, orientations=self.orientations)
        _check_finite(self, positions=self.positions, orientations=self.orientations)
        absent = [k for k in REQUIRED if k not in self.landmarks]
        if absent:
            raise ClipError(
                self.source.file,
                found=f"no point for {', '.join(absent)} among {', '.join(self.names)}",
                expected="hips, knees, ankles, shoulders, elbows and wrists of both sides",
            )

    def __repr__(self) -> str:
        return f"HumanClip({self.source.file}: {self.source.dialect}, {self.frames} frames at {self.fps:.6g} fps)"

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.positions)

    @property
    def leg_length(self) -> float:
        """Thigh and shank of somebody of this stature [m]."""
        return IDENTIFY.leg_share * self.height

    def point(self, landmark: str) -> Float[ndarray, "T 3"]:
        """Positions of a landmark [m]; pelvis, chest and neck fall back to midpoints of hips and shoulders."""
        if landmark in self.landmarks:
            return np.asarray(self.positions[:, self.names.index(self.landmarks[landmark])])
        middles = {"pelvis": "hip", "chest": "shoulder", "neck": "shoulder"}
        if landmark not in middles:
            raise KeyError(landmark)
        return 0.5 * (self.point(f"left_{middles[landmark]}") + self.point(f"right_{middles[landmark]}"))

    def orientation(self, landmark: str) -> Float[ndarray, "T 4"] | None:
        """Orientation of a landmark's point, or None where the file has none."""
        if self.orientations is None or landmark not in self.landmarks:
            return None
        return np.asarray(self.orientations[:, self.names.index(self.landmarks[landmark])])


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RobotClip:
    """Root pose and joint angles of a robot. Joints are a subset of the robot's, addressed by name."""

    fps: float
    robot: str  # key in the robot catalogue
    joint_names: tuple[str, ...]
    root_pos: Float[ndarray, "T 3"]  # [m], world
    root_quat: Float[ndarray, "T 4"]  # wxyz, world_from_root
    joint_pos: Float[ndarray, "T J"]  # [rad]
    source: Provenance

    def __post_init__(self) -> None:
        _check_time(self)
        _check_names(self, self.joint_names)
        frames = len(self.root_pos)
        _check_shape(self, "root_pos", self.root_pos, (frames, 3))
        _check_shape(self, "root_quat", self.root_quat, (frames, 4))
        _check_shape(self, "joint_pos", self.joint_pos, (frames, len(self.joint_names)))
        _freeze(self, root_pos=self.root_pos, root_quat=self.root_quat, joint_pos=self.joint_pos)
        _check_finite(self, root_pos=self.root_pos, root_quat=self.root_quat, joint_pos=self.joint_pos)
        worst = float(np.abs(np.linalg.norm(self.root_quat, axis=-1) - 1.0).max())
        if worst > 1e-6:
            raise ClipError(
                self.source.file, found=f"root quaternions off unit length by {worst:.2g}", expected="unit ones"
            )

    def __repr__(self) -> str:
        return f"RobotClip({self.source.file}: {self.robot}, {self.frames} frames at {self.fps:.6g} fps)"

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.root_pos)


Clip = HumanClip | RobotClip


def full_qpos(clip: RobotClip, robot: RobotModel) -> Float[ndarray, "T nq"]:
    """qpos of a robot clip in the robot's joint order; joints that the clip lacks stand at the default pose."""
    qpos = np.tile(robot.default_qpos, (clip.frames, 1))
    qpos[:, :3], qpos[:, 3:7] = clip.root_pos, clip.root_quat
    qpos[:, [7 + robot.joint(n) for n in clip.joint_names]] = clip.joint_pos
    return qpos


def _check_time(clip: Any) -> None:
    if not (np.isfinite(clip.fps) and clip.fps > 0):
        raise ClipError(clip.source.file, found=f"{clip.fps} frames per second", expected="a number above 0")
    if clip.frames < MIN_FRAMES:
        raise ClipError(clip.source.file, found=f"{clip.frames} frames", expected=f"at least {MIN_FRAMES}")


def _check_names(clip: Any, names: tuple[str, ...]) -> None:
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ClipError(clip.source.file, found=f"the name {', '.join(twice)} twice", expected="unique names")


def _check_shape(clip: Any, name: str, array: ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(array) != shape:
        raise ClipError(clip.source.file, found=f"{name} of shape {np.shape(array)}", expected=f"{shape}")


def _check_finite(clip: Any, **arrays: ndarray | None) -> None:
    for name, array in arrays.items():
        if array is not None and not np.isfinite(array).all():
            bad = np.flatnonzero(~np.isfinite(array).reshape(len(array), -1).all(axis=1))
            raise ClipError(
                f"{clip.source.file}, frame {bad[0]}",
                found=f"{len(bad)} frames of {name} that are not finite",
                expected="finite numbers",
            )


def _freeze(clip: Any, **arrays: ndarray | None) -> None:
    for name, array in arrays.items():
        if array is not None:
            copy = np.array(array, dtype=float)
            copy.setflags(write=False)
            object.__setattr__(clip, name, copy)
