"""Stances whose soles would overlap are moved apart: a robot's feet are wider than a person's in its size.

Each stance moves as one, so that nothing slides; the swings between follow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import FREE
from clips.runs import runs_of
from retarget.feet import FootTargets, spread
from robot_models import FEET, RobotModel
from robot_models import rotation as rot

_GAP = 0.010  # kept between the soles of two standing feet [m]
_ROUNDS = 10  # a stance that gives way to one may meet another
_NOTHING = 5e-4  # of a move [m]


def parted(feet: FootTargets, robot: RobotModel, fps: float) -> FootTargets:
    """The same feet, no sole on another while both stand; each gives way by half.

    Args:
        feet: where they would be.
        robot: gives the soles.
        fps: of the frames.
    """
    stands = (feet.contact != FREE).reshape(-1, 2, 2).any(axis=2)
    moved = np.zeros_like(feet.shift)
    for _ in range(_ROUNDS):
        apart = np.where(stands.all(axis=1)[:, None], _overlap(feet, moved, robot), 0.0)
        if np.abs(apart).max(initial=0.0) < _NOTHING:
            break
        for k, way in enumerate((-0.5, 0.5)):
            needed = np.zeros_like(apart)
            for a, b in runs_of(stands[:, k]):
                needed[a:b] = apart[a + np.argmax(np.linalg.norm(apart[a:b], axis=1))]
            moved[:, k] += way * spread(needed, stands[:, k], fps)
    pos = feet.pos.copy()
    pos[..., :2] += moved
    return replace(feet, pos=pos, shift=feet.shift + moved)


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
