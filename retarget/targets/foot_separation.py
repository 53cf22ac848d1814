"""Feet that would meet are led apart: a robot's are wider than a person's in its size.

Each stance moves as one, so that nothing slides. The swings between follow, and go round the foot that stands.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import FREE
from retarget.config import FeetConfig
from retarget.targets.feet import FootTargets, interpolate_offsets, smoothstep
from robot_models import FEET, RobotModel
from robot_models.maths import intervals_of
from robot_models.maths import rotation as rot


def separate_feet(feet: FootTargets, robot: RobotModel, fps: float, config: FeetConfig = FeetConfig()) -> FootTargets:
    """The same feet, no sole on another: of two that stand each gives way by half, else the one that swings.

    Args:
        feet: where they would be.
        robot: gives the soles.
        fps: of the frames.
        config: how far apart.
    """
    stands = (feet.contact != FREE).reshape(-1, 2, 2).any(axis=2)
    both, low = stands.all(axis=1), np.abs(feet.pos[:, 0, 2] - feet.pos[:, 1, 2]) < config.crossing_height
    middles, axes, room = _footprints(feet, robot, config.sole_gap)
    moved = np.zeros_like(feet.shift)
    for _ in range(config.separation_rounds):
        overlap = _overlap(middles + moved, axes, room) * both[:, None]
        if not overlap.any():
            break
        for k, way in enumerate((-0.5, 0.5)):
            moved[:, k] += way * interpolate_offsets(_of_stances(overlap, stands[:, k]), stands[:, k], fps, config)
    for _ in range(config.separation_rounds):
        overlap = _overlap(middles + moved, axes, room) * (low & ~both)[:, None]
        if not overlap.any():
            break
        for k, way in enumerate((-1.0, 1.0)):
            moved[:, k] += way * _round_the_other(overlap * stands[:, 1 - k, None], ~stands[:, k])
    return feet.moved(moved)


def _of_stances(overlap: Float[ndarray, "T 2"], stands: Bool[ndarray, "T"]) -> Float[ndarray, "T 2"]:
    """Every stance's longest way, in all its frames."""
    out = np.zeros_like(overlap)
    for a, b in intervals_of(stands):
        out[a:b] = overlap[a + _longest(overlap[a:b])]
    return out


def _round_the_other(overlap: Float[ndarray, "T 2"], swings: Bool[ndarray, "T"]) -> Float[ndarray, "T 2"]:
    """Every swing's longest way, taken up and given back smoothly on both sides of the frame that needs it."""
    out = np.zeros_like(overlap)
    for a, b in intervals_of(swings):
        top = _longest(overlap[a:b])
        out[a:b] = _bump(b - a, top)[:, None] * overlap[a + top]
    return out


def _longest(ways: Float[ndarray, "T 2"]) -> int:
    return int(np.argmax(np.linalg.norm(ways, axis=1)))


def _bump(frames: int, top: int) -> Float[ndarray, "T"]:
    """Rises smoothly from 0 to 1 at `top`, and falls again."""
    t = np.arange(frames)
    return smoothstep(np.minimum((t + 1) / (top + 1), (frames - t) / (frames - top)))


def _footprints(
    feet: FootTargets, robot: RobotModel, gap: float
) -> tuple[Float[ndarray, "T 2 2"], Float[ndarray, "T 4 2"], Float[ndarray, "T 4"]]:
    """Both soles on the floor: middles, the directions of their sides, and along these the room that the two need."""
    yaw = rot.yaw(feet.quat)
    ahead = np.stack((np.cos(yaw), np.sin(yaw)), axis=-1)
    axes = np.concatenate((ahead, np.stack((-ahead[..., 1], ahead[..., 0]), axis=-1)), axis=1)
    middles, room = feet.pos[..., :2].copy(), np.full(axes.shape[:2], gap)
    for k, side in enumerate(FEET):
        corners = np.asarray(robot.soles[side].corners) * [1.0, 1.0, 0.0]
        placed = rot.rotate(rot.from_yaw(yaw[:, k])[:, None], corners[None])[..., :2]
        middles[:, k] += placed.mean(axis=1)
        room += 0.5 * np.ptp(placed @ axes.swapaxes(1, 2), axis=1)
    return middles, axes, room


def _overlap(
    middles: Float[ndarray, "T 2 2"], axes: Float[ndarray, "T 4 2"], room: Float[ndarray, "T 4"]
) -> Float[ndarray, "T 2"]:
    """The shortest way that the right sole must go to be clear of the left one, by separating axes [m]."""
    between = (axes @ (middles[:, 1] - middles[:, 0])[..., None])[..., 0]
    depth = room - np.abs(between)
    frames, best = np.arange(len(axes)), np.argmin(depth, axis=1)
    way = np.where(between[frames, best] < 0.0, -1.0, 1.0) * np.maximum(depth[frames, best], 0.0)
    return way[:, None] * axes[frames, best]
