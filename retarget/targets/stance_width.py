"""Stances drawn in under the hips where the ankle could not turn as far as a flat sole asks.

A person who stands wide tilts the feet at the ankles; many robots' ankles roll by 15 degrees. Such a robot would
stand on the inner sides of its soles. Each stance moves as one, so that nothing slides.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import FREE
from retarget.config import FeetConfig
from retarget.targets.feet import FootTargets, interpolate_offsets
from robot_models import FEET, RobotModel, ancestors, joint_axes
from robot_models.maths import intervals_of
from robot_models.maths import rotation as rot


def narrow_stances(
    feet: FootTargets, hips: Float[ndarray, "T 2 3"], robot: RobotModel, fps: float, config: FeetConfig = FeetConfig()
) -> FootTargets:
    """The same feet, those that stand so far beside their hips that the sole would tilt moved towards them.

    A leg that leans sideways by an angle needs that angle of the ankle's roll. A stance moves by the median of what
    its flat frames ask for: a sway beyond the ankle's range that passes shall not draw the whole stance in.

    Args:
        feet: where they would be.
        hips: left and right [m].
        robot: gives the ankles.
        fps: of the frames.
        config: how much of the ankle's range is kept.
    """
    moved = np.zeros_like(feet.shift)
    for k, side in enumerate(FEET):
        in_contact = feet.contact[:, 2 * k : 2 * k + 2] != FREE
        flat, stands = in_contact.all(axis=1), in_contact.any(axis=1)
        yaw = rot.yaw(feet.quat[:, k])
        left = np.stack((-np.sin(yaw), np.cos(yaw)), axis=-1)
        leg = hips[:, k] - feet.pos[:, k]
        beside = np.sum(leg[:, :2] * left, axis=1)
        low, high = (np.maximum(leg[:, 2], 0.0) * np.tan(end) for end in _roll_range(robot, side, config))
        beyond = beside - np.clip(beside, low, high)
        moved[:, k] = interpolate_offsets(_of_stances(beyond[:, None] * left, flat, stands), stands, fps, config)
    return feet.moved(moved)


def _of_stances(way: Float[ndarray, "T 2"], flat: Bool[ndarray, "T"], stands: Bool[ndarray, "T"]) -> ndarray:
    """Every stance's median way over its flat frames, in all its frames."""
    out = np.zeros_like(way)
    for a, b in intervals_of(stands):
        if flat[a:b].any():
            out[a:b] = np.median(way[a:b][flat[a:b]], axis=0)
    return out


def _roll_range(robot: RobotModel, side: str, config: FeetConfig) -> tuple[float, float]:
    """How far a foot can turn about its own length against the shin [rad]; without end where no joint is known."""
    _, _, axes, _ = joint_axes(robot, robot.zero_qpos[None])
    carried = ancestors(robot)
    ankle = carried[robot.landmark(f"{side}_foot")] & ~carried[robot.landmark(f"{side}_knee")]
    rolls = np.flatnonzero(ankle & (np.abs(axes[0, :, 0]) > config.roll_cosine))
    if not len(rolls):
        return -0.5 * np.pi, 0.5 * np.pi
    lower, upper = (bound[rolls[0]] for bound in robot.ranges(config.ankle_margin))
    return (lower, upper) if axes[0, rolls[0], 0] > 0.0 else (-upper, -lower)
