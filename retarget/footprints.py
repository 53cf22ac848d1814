"""Feet that would meet are led apart: a robot's are wider than a person's in its size.

Each stance moves as one, so that nothing slides. The swings between follow, and go round the foot that stands.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import FREE
from clips.runs import runs_of
from retarget.feet import FootTargets, smoothstep, spread
from robot_models import FEET, RobotModel
from robot_models import rotation as rot

_GAP = 0.010  # kept between the soles of two standing feet [m]
_LOW = 0.12  # one foot over the other, up to which they meet [m]
_ROUNDS = 10  # a stance that gives way to one may meet another


def parted(feet: FootTargets, robot: RobotModel, fps: float) -> FootTargets:
    """The same feet, no sole on another: of two that stand each gives way by half, else the one that swings.

    Args:
        feet: where they would be.
        robot: gives the soles.
        fps: of the frames.
    """
    stands = (feet.contact != FREE).reshape(-1, 2, 2).any(axis=2)
    both, low = stands.all(axis=1), np.abs(feet.pos[:, 0, 2] - feet.pos[:, 1, 2]) < _LOW
    moved = np.zeros_like(feet.shift)
    for _ in range(_ROUNDS):
        overlap = _overlap(feet, moved, robot) * both[:, None]
        for k, way in enumerate((-0.5, 0.5)):
            moved[:, k] += way * spread(_of_stances(overlap, stands[:, k]), stands[:, k], fps)
    for _ in range(_ROUNDS):
        overlap = _overlap(feet, moved, robot) * low[:, None]
        for k, way in enumerate((-1.0, 1.0)):
            moved[:, k] += way * _round_the_other(overlap * stands[:, 1 - k, None], ~stands[:, k])
    pos = feet.pos.copy()
    pos[..., :2] += moved
    return replace(feet, pos=pos, shift=feet.shift + moved)


def _of_stances(overlap: Float[ndarray, "T 2"], stands: Bool[ndarray, "T"]) -> Float[ndarray, "T 2"]:
    """Every stance's longest way, in all its frames."""
    out = np.zeros_like(overlap)
    for a, b in runs_of(stands):
        out[a:b] = overlap[a + _longest(overlap[a:b])]
    return out


def _round_the_other(overlap: Float[ndarray, "T 2"], swings: Bool[ndarray, "T"]) -> Float[ndarray, "T 2"]:
    """Every swing's longest way, taken up and given back smoothly on both sides of the frame that needs it."""
    out = np.zeros_like(overlap)
    for a, b in runs_of(swings):
        top = _longest(overlap[a:b])
        out[a:b] = _bump(b - a, top)[:, None] * overlap[a + top]
    return out


def _longest(ways: Float[ndarray, "T 2"]) -> int:
    return int(np.argmax(np.linalg.norm(ways, axis=1)))


def _bump(frames: int, top: int) -> Float[ndarray, "T"]:
    """Rises smoothly from 0 to 1 at `top`, and falls again."""
    t = np.arange(frames)
    return smoothstep(np.minimum((t + 1) / (top + 1), (frames - t) / (frames - top)))


def _overlap(feet: FootTargets, moved: Float[ndarray, "T 2 2"], robot: RobotModel) -> Float[ndarray, "T 2"]:
    """The shortest way that the right sole must go to be clear of the left one, by separating axes [m]."""
    yaw = rot.yaw(feet.quat)
    ahead = np.stack((np.cos(yaw), np.sin(yaw)), axis=-1)  # (T, foot, 2)
    axes = np.concatenate((ahead, np.stack((-ahead[..., 1], ahead[..., 0]), axis=-1)), axis=1)
    middles, extents = [], []
    for k, side in enumerate(FEET):
        corners = np.asarray(robot.soles[side].corners)
        level = np.concatenate((corners[:, :2], np.zeros((4, 1))), axis=1)
        placed = rot.rotate(rot.from_yaw(yaw[:, k])[:, None], level[None])[..., :2]
        along = np.einsum("tcx,tax->tac", placed, axes)
        middles.append(feet.pos[:, k, :2] + moved[:, k] + placed.mean(axis=1))
        extents.append(0.5 * np.ptp(along, axis=2))
    between = np.einsum("tx,tax->ta", middles[1] - middles[0], axes)
    depth = extents[0] + extents[1] + _GAP - np.abs(between)
    best = np.argmin(depth, axis=1)[:, None]
    depth, side_of = np.take_along_axis(depth, best, axis=1), np.take_along_axis(between, best, axis=1)
    return np.maximum(depth, 0.0) * np.where(side_of < 0.0, -1.0, 1.0) * axes[np.arange(len(axes)), best[:, 0]]
