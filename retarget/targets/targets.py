"""The person's motion in the robot's proportions: where pelvis, trunk, limbs and feet shall be.

Every limb keeps the source's direction and takes the robot's own length. Only the ground plane is scaled by one
number, legs over legs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import GLIDING, HumanClip
from retarget.config import RetargetConfig
from retarget.targets.contacts import UNSTATED, Contacts
from retarget.targets.feet import FootTargets, flat_height, foot_targets
from retarget.targets.floor_parts import FloorParts, floor_parts, join_parts
from retarget.targets.foot_separation import separate_feet
from retarget.targets.segment_frames import trunk_frames
from retarget.targets.stance_width import narrow_stances
from robot_models import FEET, RobotModel, forward_kinematics, leg_length
from robot_models.maths import rotation as rot
from robot_models.maths import smooth

LIMBS = tuple(
    (f"{side}_{start}", f"{side}_{end}")
    for side in FEET
    for start, end in (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "wrist"))
)
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class Targets:
    """Goals of the solver in the robot's world. Orientations are of the robot's bodies, wxyz."""

    fps: float
    scale: float  # robot leg length over the person's
    pelvis_pos: Float[ndarray, "T 3"]
    pelvis_quat: Float[ndarray, "T 4"]
    torso_quat: Float[ndarray, "T 4"]
    limbs: Mapping[tuple[str, str], Float[ndarray, "T 3"]]  # (from, to) -> vector of the robot's length [m]
    feet: FootTargets
    airborne: Bool[ndarray, "T"]  # frames of jumps, in which nothing carries
    parts: FloorParts  # of the body, that come near the floor
    stated: Int[ndarray, "T 4"]  # what the user says each edge does; UNSTATED where nothing

    def at(self, frames: Int[ndarray, "F"]) -> Targets:
        """The same goals on some of the frames."""
        feet = FootTargets(**{f.name: getattr(self.feet, f.name)[frames] for f in fields(FootTargets)})
        return replace(
            self,
            pelvis_pos=self.pelvis_pos[frames],
            pelvis_quat=self.pelvis_quat[frames],
            torso_quat=self.torso_quat[frames],
            limbs={k: v[frames] for k, v in self.limbs.items()},
            feet=feet,
            airborne=self.airborne[frames],
            parts=self.parts.at(frames),
            stated=self.stated[frames],
        )

    def gliding(self, found: Bool[ndarray, "T 4"]) -> Targets:
        """The same goals with edges gliding over the floor: those that were found to, and those that are said to."""
        glides = np.where(self.stated == UNSTATED, found, self.stated == GLIDING)
        contact = np.where(glides, GLIDING, self.feet.contact)
        return replace(self, feet=replace(self.feet, contact=contact))


def make_targets(clip: HumanClip, contacts: Contacts, robot: RobotModel, config: RetargetConfig) -> Targets:
    """Lay the source out in the robot's proportions with its feet locked."""
    zero_pos, zero_quat = (a[0] for a in forward_kinematics(robot, robot.zero_qpos[None]))
    scale = leg_length(robot) / _leg_length(clip)
    pelvis, torso = trunk_frames(clip)
    hips = 0.5 * (clip.point("left_hip") + clip.point("right_hip"))
    floor = np.mean([flat_height(clip, contacts, k) for k in range(2)])
    middle = scale * (hips - floor * _Z) - np.mean([s.z for s in robot.soles.values()]) * _Z
    hip_offsets = {s: zero_pos[robot.landmark(f"{s}_hip")] - zero_pos[0] for s in FEET}
    apart = np.stack([0.5 * (hip_offsets[s] - hip_offsets[o]) for s, o in (FEET, FEET[::-1])])
    feet = foot_targets(clip, contacts, robot, scale, config.feet)
    feet = narrow_stances(
        feet, middle[:, None] + rot.rotate(pelvis[:, None], apart[None]), robot, clip.fps, config.feet
    )
    feet = separate_feet(feet, robot, clip.fps, config.feet)
    middle[:, :2] += smooth(feet.shift.mean(axis=1), clip.fps, config.feet.follow_hz)
    pelvis_pos = middle - rot.rotate(pelvis, np.broadcast_to(np.mean(list(hip_offsets.values()), axis=0), middle.shape))
    # A robot's own figure has legs that reach where they stand; a person's may be longer than the scale says.
    reach = config.feet.straight_leg if clip.upright else config.reach
    pelvis_pos[:, 2] -= _crouch(pelvis_pos, pelvis, hip_offsets, feet, robot, reach, clip.fps)
    return Targets(
        fps=clip.fps,
        scale=scale,
        pelvis_pos=pelvis_pos,
        pelvis_quat=rot.multiply(pelvis, np.broadcast_to(zero_quat[0], pelvis.shape)),
        torso_quat=rot.multiply(torso, np.broadcast_to(zero_quat[robot.landmark("torso")], torso.shape)),
        limbs=_limbs(clip, robot, zero_pos, zero_quat),
        feet=feet,
        airborne=np.zeros(clip.frames, dtype=bool),
        parts=floor_parts(clip, scale, config.parts, contacts.stated_parts),
        stated=contacts.stated,
    )


def join(parts: Sequence[Targets]) -> Targets:
    """One after the other, in one world."""

    def along(pick: Callable[[Targets], ndarray]) -> ndarray:
        return np.concatenate([pick(p) for p in parts])

    return replace(
        parts[0],
        pelvis_pos=along(lambda p: p.pelvis_pos),
        pelvis_quat=rot.continuous(along(lambda p: p.pelvis_quat)),
        torso_quat=rot.continuous(along(lambda p: p.torso_quat)),
        limbs={k: np.concatenate([p.limbs[k] for p in parts]) for k in parts[0].limbs},
        airborne=along(lambda p: p.airborne),
        parts=join_parts([p.parts for p in parts]),
        stated=along(lambda p: p.stated),
        feet=FootTargets(
            pos=along(lambda p: p.feet.pos),
            quat=rot.continuous(along(lambda p: p.feet.quat)),
            contact=along(lambda p: p.feet.contact),
            shift=along(lambda p: p.feet.shift),
        ),
    )


def _leg_length(clip: HumanClip) -> float:
    """Hip to knee to ankle [m], median over frames, mean of both legs."""
    legs = [
        np.linalg.norm(clip.point(f"{s}_{a}") - clip.point(f"{s}_{b}"), axis=1)
        for s in FEET
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    ]
    return float(np.median(legs, axis=1).sum() / 2.0)


def _limbs(clip: HumanClip, robot: RobotModel, zero_pos: ndarray, zero_quat: ndarray) -> dict[tuple[str, str], ndarray]:
    """The robot's segment lengths along the source's directions."""
    limbs = {}
    for start, end in LIMBS:
        length = float(np.linalg.norm(np.diff(robot.landmark_pos((start, end), zero_pos, zero_quat), axis=0)))
        along = clip.point(end.replace("foot", "ankle")) - clip.point(start)
        limbs[start, end] = length * rot.unit(along)
    return limbs


def _crouch(
    pelvis_pos: ndarray,
    pelvis: ndarray,
    hip_offsets: Mapping[str, ndarray],
    feet: FootTargets,
    robot: RobotModel,
    reach: float,
    fps: float,
) -> ndarray:
    """How far the pelvis must come down so that planted feet stay within reach [m], smooth in time."""
    from scipy.ndimage import maximum_filter1d

    need = np.zeros(len(pelvis_pos))
    limit = reach * leg_length(robot)
    for k, side in enumerate(FEET):
        hip = pelvis_pos + rot.rotate(pelvis, np.broadcast_to(hip_offsets[side], pelvis_pos.shape))
        away = hip - feet.pos[:, k]
        highest = np.sqrt(np.maximum(limit**2 - (away[:, :2] ** 2).sum(axis=1), 0.0))
        planted = feet.contact[:, 2 * k : 2 * k + 2].any(axis=1)
        need = np.maximum(need, np.where(planted, away[:, 2] - highest, 0.0))
    window = max(1, int(0.2 * fps))
    return np.maximum(smooth(maximum_filter1d(need, window), fps, 2.0), 0.0)
