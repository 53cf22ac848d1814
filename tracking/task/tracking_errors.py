"""Robot against reference at one instant: every error that rewards, terminations and evaluation use."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import Reference
from robot_models import FEET, BodyStates, RobotModel
from robot_models.maths import Array, array_namespace
from robot_models.maths import rotation as rot
from tracking.config import TerminationConfig


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackingErrors:
    """Reference minus robot. N environments, K tracked bodies.

    Body errors are taken after the reference is moved to the robot's heading and place on the floor (its height
    kept), as the field does: the actor cannot see where in the room it stands.
    """

    anchor_pos: Float[Array, "N 3"]  # world frame [m]
    anchor_angle: Float[Array, "N"]  # [rad]
    anchor_tilt: Float[Array, "N"]  # difference of gravity's z in the two anchor frames
    body_pos: Float[Array, "N K 3"]  # [m]
    body_angle: Float[Array, "N K"]  # [rad]
    body_lin_vel: Float[Array, "N K 3"]  # world frame [m/s]
    body_ang_vel: Float[Array, "N K 3"]  # world frame [rad/s]


@dataclass(frozen=True, kw_only=True, eq=False)
class InAnchor:
    """A reference by frame, in its anchor's frame."""

    pos: Float[Array, "T K"]  # three numbers per tracked body, from the anchor [m]
    lin_vel: Float[Array, "T 3"]  # of the anchor [m/s]
    height: Float[Array, "T 1"]  # of the anchor over the floor [m]


class ReferenceTables:
    """The tracked bodies of one or several references by frame, in arrays made for look-ups.

    Several stand one after the other: a frame is a place in that row, and `last` is where its own reference ends.
    """

    def __init__(self, references: Sequence[Reference], robot: RobotModel) -> None:
        bodies = [robot.body(b) for b in robot.profile.tracked]
        self.bodies = bodies
        self.anchor = robot.profile.tracked.index(robot.profile.anchor)
        feet = [robot.soles[s].body for s in FEET]
        wrists = [robot.profile.landmarks[f"{s}_wrist"] for s in FEET]
        ends = [robot.profile.tracked.index(b) for b in (*feet, *wrists) if b in robot.profile.tracked]
        self.ends = np.array(ends, dtype=int)
        lengths = np.array([r.frames for r in references])
        after = np.cumsum(lengths)
        self.frames = int(after[-1])
        self.first, self.last = np.repeat(after - lengths, lengths), np.repeat(after - 1, lengths)
        self.openings = after - lengths + [r.dance.start for r in references]

        def row(of: Callable[[Reference], ndarray]) -> ndarray:
            return np.concatenate([np.asarray(of(r)) for r in references])

        self.qpos, self.qvel = row(lambda r: r.qpos), row(lambda r: r.qvel)
        self.joint_pos, self.joint_vel = row(lambda r: r.joint_pos), row(lambda r: r.joint_vel)
        self.pos, self.quat = row(lambda r: r.body_pos_w[:, bodies]), row(lambda r: r.body_quat_w[:, bodies])
        self.lin_vel = row(lambda r: r.body_lin_vel_w[:, bodies])
        self.ang_vel = row(lambda r: r.body_ang_vel_w[:, bodies])

    def ahead(self, frame: Int[Array, "N"], frames: int) -> Int[Array, "N"]:
        """Places so many frames on; the last frame of a reference holds beyond its end."""
        return array_namespace(frame).minimum(frame + frames, self.last[frame])

    def only(self, references: int) -> ReferenceTables:
        """The tables of the first references alone."""
        some, frames = copy.copy(self), int(self.last[self.openings[references - 1]]) + 1
        for name, value in vars(self).items():
            if isinstance(value, ndarray) and len(value) == self.frames:
                setattr(some, name, value[:frames])
        some.frames, some.openings = frames, self.openings[:references]
        return some

    def in_anchor(self) -> InAnchor:
        """What the reference's bodies do, seen from its anchor."""
        to_anchor = rot.conjugate(self.quat[:, self.anchor])
        away = self.pos - self.pos[:, self.anchor, None]
        return InAnchor(
            pos=rot.rotate(to_anchor[:, None], away).reshape(self.frames, -1),
            lin_vel=rot.rotate(to_anchor, self.lin_vel[:, self.anchor]),
            height=self.pos[:, self.anchor, 2:],
        )

    def on(self, to_device: Callable[[ndarray], Array]) -> ReferenceTables:
        """The same tables in other memory."""
        moved = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, ndarray):
                setattr(moved, name, to_device(value))
        return moved


def compare(states: BodyStates, tables: ReferenceTables, frame: Int[Array, "N"]) -> TrackingErrors:
    """Errors of the robots' tracked bodies against the reference's frames."""
    pos, quat = states.pos, states.quat
    ref_pos, ref_quat = tables.pos[frame], tables.quat[frame]
    a = tables.anchor
    turn = rot.from_yaw(rot.yaw(rot.multiply(quat[:, a], rot.conjugate(ref_quat[:, a]))))[:, None]
    place = array_namespace(pos).concat((pos[:, a, :2], ref_pos[:, a, 2:]), axis=-1)
    moved_pos = place[:, None] + rot.rotate(turn, ref_pos - ref_pos[:, a, None])
    moved_quat = rot.multiply(turn, ref_quat)
    return TrackingErrors(
        anchor_pos=ref_pos[:, a] - pos[:, a],
        anchor_angle=rot.angle_between(quat[:, a], ref_quat[:, a]),
        anchor_tilt=_up_z(ref_quat[:, a]) - _up_z(quat[:, a]),
        body_pos=moved_pos - pos,
        body_angle=rot.angle_between(quat, moved_quat),
        body_lin_vel=tables.lin_vel[frame] - states.lin_vel,
        body_ang_vel=tables.ang_vel[frame] - states.ang_vel,
    )


FALLS = ("anchor_height", "anchor_tilt", "diverged")
"""Causes of failure that are falls; the others are strayings, after which a robot may dance on."""


def failures(errors: TrackingErrors, tables: ReferenceTables, config: TerminationConfig) -> dict[str, Bool[Array, "N"]]:
    """Which rollouts have failed, by cause."""
    xp = array_namespace(errors.body_pos)
    return {
        "anchor_height": xp.abs(errors.anchor_pos[:, 2]) > config.anchor_height,
        "anchor_tilt": xp.abs(errors.anchor_tilt) > config.anchor_tilt,
        "end_effector_height": (xp.abs(errors.body_pos[:, tables.ends, 2]) > config.end_effector_height).any(axis=1),
    }


def _up_z(quat: Array) -> Array:
    """z of the world's up direction seen in a body frame: 1 - 2 (x^2 + y^2)."""
    x, y = quat[..., 1], quat[..., 2]
    return 1.0 - 2.0 * (x * x + y * y)
