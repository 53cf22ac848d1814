"""`Reference`: what the robot shall do, on a uniform time grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips.errors import ReferenceFileError
from clips.metrics import metric_key, metric_label
from robot_models import CONTACT_NAMES, PART_NAMES, RobotModel, forward_kinematics
from robot_models.maths import rotation as rot

FREE, PLANTED, PIVOTING, GLIDING = 0, 1, 2, 3
"""What a sole edge, or another part, does: nothing; stands; turns on the spot; carries while it slides over the floor."""
_LARGEST = 1e7  # number of any array, frame numbers too: no metre, radian or torque of a robot comes near
_UNIT = 1e-4  # of a quaternion's length off one: single precision, and what other tools round to
MOTION = ("joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Reference:
    """Motion for one robot on a uniform time grid. T frames, J joints, B bodies, S segments."""

    robot: str  # key in the robot catalogue
    robot_hash: str
    fps: float
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]  # body 0 is the root
    joint_pos: Float[ndarray, "T J"]  # [rad]
    joint_vel: Float[ndarray, "T J"]  # [rad/s]
    body_pos_w: Float[ndarray, "T B 3"]  # [m], world frame
    body_quat_w: Float[ndarray, "T B 4"]  # wxyz, world_from_body, sign-continuous in T
    body_lin_vel_w: Float[ndarray, "T B 3"]  # [m/s], of the body origin
    body_ang_vel_w: Float[ndarray, "T B 3"]  # [rad/s], world frame
    contact: Int[ndarray, "T F"]  # per sole edge: FREE, PLANTED, PIVOTING or GLIDING
    segments: Int[ndarray, "S 3"]  # start, end, 1 if continuous with the one before
    meta: Mapping[str, Any]  # the rest of the JSON entry: source, config, versions, report
    joint_torque: Float[ndarray, "T J"] | None = None  # by inverse dynamics [N m]; None where nobody computed it
    part_contact: Int[ndarray, "T P"] | None = None  # as `contact`, of PART_NAMES; None where feet alone touch

    def __post_init__(self) -> None:
        for names in (self.joint_names, self.body_names):
            if len(set(names)) < len(names) or not names:
                raise _refused("joint_names, body_names", f"{len(names)} names, some twice or none", "a name for each")
        if not (np.isfinite(self.fps) and self.fps > 0.0):
            raise _refused("fps", repr(self.fps), "frames per second, above 0")
        frames, joints, bodies = self.frames, len(self.joint_names), len(self.body_names)
        shapes: dict[str, tuple[int, ...]] = {
            **dict.fromkeys(("joint_pos", "joint_vel", *self.optional), (frames, joints)),
            **dict.fromkeys(("body_pos_w", "body_lin_vel_w", "body_ang_vel_w"), (frames, bodies, 3)),
            "body_quat_w": (frames, bodies, 4),
            "contact": (frames, len(CONTACT_NAMES)),
            **({} if self.part_contact is None else {"part_contact": (frames, len(PART_NAMES))}),
            "segments": (len(np.atleast_1d(self.segments)), 3),
        }
        for name, shape in shapes.items():
            array = np.array(getattr(self, name))
            if array.shape != shape or array.dtype.kind not in "fiu" or not (np.abs(array) <= _LARGEST).all():
                found = f"{array.dtype} of shape {array.shape}, or numbers that are not finite"
                raise _refused(name, found, f"finite numbers of shape {shape}, by the names of joints and bodies")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        length = np.linalg.norm(self.body_quat_w, axis=-1)
        if np.abs(length - 1.0).max(initial=0.0) > _UNIT:
            raise _refused(
                "body_quat_w", f"quaternions of length {length.min():.4g} to {length.max():.4g}", "unit ones"
            )
        for name in ("contact",) if self.part_contact is None else ("contact", "part_contact"):
            kinds = np.unique(getattr(self, name))
            if not np.isin(kinds, (FREE, PLANTED, PIVOTING, GLIDING)).all():
                raise _refused(name, f"kinds {kinds.tolist()}", "0 free, 1 planted, 2 pivoting, 3 gliding")
        self._check_segments()

    def __repr__(self) -> str:
        return f"Reference({self.robot}, {self.frames} frames at {self.fps:g} fps, {self.duration_s:.1f} s)"

    def _check_segments(self) -> None:
        """Ranges of frames one after another, each told to be continuous with the one before or not."""
        start, end, joined = self.segments.T
        rising = (start < end).all() and (start[1:] >= end[:-1]).all()
        if not (len(start) and rising and start[0] >= 0 and end[-1] <= self.frames and np.isin(joined, (0, 1)).all()):
            expected = f"rows of start, end and 0 or 1, one after another within {self.frames} frames"
            raise _refused("segments", f"{self.segments.tolist()}", expected)

    @property
    def optional(self) -> tuple[str, ...]:
        """The optional keys that this reference has."""
        return ("joint_torque",) if self.joint_torque is not None else ()

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.joint_pos)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame [s]."""
        return (self.frames - 1) / self.fps

    @property
    def qpos(self) -> Float[ndarray, "T nq"]:
        """MuJoCo's qpos: root position, root wxyz, joints."""
        return np.concatenate((self.body_pos_w[:, 0], self.body_quat_w[:, 0], self.joint_pos), axis=1)

    @property
    def qvel(self) -> Float[ndarray, "T nv"]:
        """MuJoCo's qvel: the root's linear velocity in the world frame, its angular velocity in the body frame."""
        spin_b = rot.rotate(rot.conjugate(self.body_quat_w[:, 0]), self.body_ang_vel_w[:, 0])
        return np.concatenate((self.body_lin_vel_w[:, 0], spin_b, self.joint_vel), axis=1)

    @property
    def failed_gates(self) -> tuple[str, ...]:
        """The gates that it missed when it was made, as far as its file says: titles, parts and moments."""
        return tuple(_moment(key, measured) for key, measured in self.report.items() if not measured["passed"])

    @property
    def report(self) -> Mapping[str, Mapping[str, Any]]:
        """What was measured on it when it was made: value, unit, limit and passed, by `MetricKey`; {} if unknown."""
        return {metric_key(name): measured for name, measured in self.meta.get("report", {}).items()}

    @property
    def dance(self) -> slice:
        """Frames of the dance itself, between lead-in and lead-out; from the first to the last of several."""
        return slice(self.dances[0].start, self.dances[-1].stop)

    @property
    def leads(self) -> tuple[slice, ...]:
        """Frames of lead-in and lead-out, where it has them."""
        names = self.meta.get("segment_names", ())
        found = [row for row, name in zip(self.segments, names, strict=False) if name.startswith("lead-")]
        return tuple(slice(int(a), int(b)) for a, b, _ in found)

    @property
    def dances(self) -> tuple[slice, ...]:
        """Frames of each dance; all of them where nothing is said of segments."""
        kinds = np.array(self.meta.get("segment_names", ()))
        found = self.segments[np.flatnonzero(kinds == "dance")]
        return tuple(slice(int(a), int(b)) for a, b, _ in found) or (slice(0, self.frames),)


def _moment(key: str, measured: Mapping[str, Any]) -> str:
    """`deepest self-collision (left hand, right thigh) at 14.10 s`."""
    parts, at_s = measured.get("parts"), measured.get("at_s")
    where = f" ({', '.join(map(str, parts))})" if isinstance(parts, list) and parts else ""
    return f"{metric_label(key)}{where}" + (f" at {at_s:.2f} s" if isinstance(at_s, int | float) else "")


def _refused(what: str, found: str, expected: str) -> ReferenceFileError:
    return ReferenceFileError(f"reference, {what}", found=found[:200], expected=expected)


def make_reference(
    robot: RobotModel,
    qpos: Float[ndarray, "T nq"],
    fps: float,
    *,
    contact: Int[ndarray, "T F"],
    segments: Int[ndarray, "S 3"],
    meta: Mapping[str, Any],
    part_contact: Int[ndarray, "T P"] | None = None,
) -> Reference:
    """A reference whose bodies and velocities follow from qpos: central differences, angular by the log map."""
    dt = 1.0 / fps
    pos, quat = forward_kinematics(robot, qpos)
    return Reference(
        robot=robot.name,
        robot_hash=robot.hash,
        fps=fps,
        joint_names=robot.joint_names,
        body_names=robot.body_names,
        joint_pos=qpos[:, 7:],
        joint_vel=rot.linear_velocity(qpos[:, 7:], dt),
        body_pos_w=pos,
        body_quat_w=quat,
        body_lin_vel_w=rot.linear_velocity(pos, dt),
        body_ang_vel_w=rot.angular_velocity(quat, dt),
        contact=np.asarray(contact, dtype=np.int8),
        segments=np.asarray(segments, dtype=np.int64),
        meta=meta,
        part_contact=part_contact.astype(np.int8) if part_contact is not None and part_contact.any() else None,
    )
