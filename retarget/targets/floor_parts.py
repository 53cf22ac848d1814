"""Knees, hands, elbows, seat and shoulders of a person that are on the floor: what they do there, how high the robot's are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import FREE, GLIDING, PIVOTING, PLANTED, HumanClip, heights_and_speeds, own_floor
from retarget.config import FeetConfig, PartsConfig
from retarget.targets.contacts import UNSTATED, heel_toe_points
from retarget.targets.feet import contact_share, smoothstep
from robot_models import PART_NAMES, RobotModel, forward_kinematics
from robot_models.maths import close_gaps, intervals_of

_THICK = {
    "pelvis": 0.10,
    "knee": 0.08,
    "hand": 0.06,
    "elbow": 0.06,
    "shoulder": 0.10,
}  # from the joint to the floor [m]


@dataclass(frozen=True, kw_only=True, eq=False)
class FloorParts:
    """The parts of PART_NAMES near the floor: T frames, P parts."""

    height: Float[ndarray, "T P"]  # of the robot's lowest points [m]
    share: Float[ndarray, "T P"]  # 1 on the floor, 0 well over it
    kind: Int[ndarray, "T P"]  # FREE, PLANTED, PIVOTING or GLIDING
    anchor: Float[ndarray, "T P 2"]  # where planted ones stay [m]
    held: Float[ndarray, "T P"]  # how firmly: 1 in a touch, falling to 0 around it

    def at(self, frames: Int[ndarray, "F"]) -> FloorParts:
        """Some of the frames."""
        return FloorParts(**{f.name: getattr(self, f.name)[frames] for f in fields(self)})

    def anchored(self, robot: RobotModel, qpos: Float[ndarray, "T nq"], fps: float, config: FeetConfig) -> FloorParts:
        """The same with each touch held where a motion has it, on average over the touch."""
        anchor, stands = self.anchor.copy(), (self.kind == PLANTED) | (self.kind == PIVOTING)
        if not stands.any():
            return self
        pos, _ = forward_kinematics(robot, qpos)
        for k, name in enumerate(PART_NAMES):
            anchor[:, k] = pos[:, landmark_of(robot, name), :2]
            for a, b in intervals_of(stands[:, k]):
                anchor[a:b, k] = anchor[a:b, k].mean(axis=0)
        return replace(self, anchor=anchor, held=np.where(stands, contact_share(stands, fps, config), 0.0))


def landmark_of(robot: RobotModel, part: str) -> int:
    """The body that carries a part: a hand hangs on its wrist."""
    return robot.landmark(part.replace("hand", "wrist"))


def join_parts(parts: Sequence[FloorParts]) -> FloorParts:
    """One after the other."""
    return FloorParts(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(FloorParts)})


def no_parts(frames: int) -> FloorParts:
    """Of a motion on its feet."""
    nothing = np.zeros((frames, len(PART_NAMES)))
    return FloorParts(
        height=nothing, share=nothing, kind=nothing.astype(int), anchor=np.zeros((*nothing.shape, 2)), held=nothing
    )


def floor_parts(
    clip: HumanClip, scale: float, config: PartsConfig, stated: Int[ndarray, "T P"] | None = None
) -> FloorParts:
    """Find them by their heights over the floor of the feet; the thickness of flesh is taken off.

    Args:
        clip: the source.
        scale: robot leg length over the person's.
        config: when a part is on the floor.
        stated: what the user says each part does; UNSTATED where nothing.
    """
    points = np.stack([clip.point(name.replace("hand", "wrist")) for name in PART_NAMES], axis=1)
    feet = heel_toe_points(clip)
    floor = own_floor(feet)
    over, speed = heights_and_speeds(points, clip.fps, float(floor.min()))
    flesh = config.most_flesh * np.array([_THICK[name.split("_")[-1]] for name in PART_NAMES])
    over = np.maximum(over - np.minimum(np.percentile(over, 1.0, axis=0), flesh), 0.0)
    # Whoever does not fly is carried: of one on the belly, who has no joint there, the lowest parts come down.
    lowest = np.minimum(over.min(axis=1), np.maximum((feet[..., 2] - floor).min(axis=1), 0.0))
    over = np.maximum(over - (lowest * smoothstep(2.0 - 2.0 * lowest / config.reach))[:, None], 0.0)
    share, kind = smoothstep(1.0 - over / config.reach), np.full(over.shape, FREE)
    for k, low in enumerate((over < config.touching).T):
        down = close_gaps(low, round(config.gap_s * clip.fps))
        kind[down, k] = np.where(speed[down, k] < config.still, PLANTED, GLIDING)
    if stated is not None:
        # What is said as it was found changes nothing; the rest eases in and out as soles do.
        other = (stated != UNSTATED) & ((stated == FREE) != (kind == FREE))
        down = other & (stated != FREE)
        kind = np.where(stated != UNSTATED, stated, kind)
        share = np.where(other & ~down, 0.0, np.maximum(share, contact_share(down, clip.fps)))
        over = np.where(down, 0.0, over)
    return replace(no_parts(clip.frames), height=scale * over, share=share, kind=kind)
