"""When a point of a body counts as standing on the floor: its height and speed, and rules of so much of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True)
class ContactRule:
    """A point stands while it is lower and slower than this."""

    height: float  # over its floor [m]
    speed: float  # [m/s]

    def holds(self, height: Float[ndarray, "T K"], speed: Float[ndarray, "T K"]) -> Bool[ndarray, "T K"]:
        """Where both are below the rule's."""
        return np.asarray((height < self.height) & (speed < self.speed))


def heights_and_speeds(
    points: Float[ndarray, "T K 3"], fps: float, floor: Float[ndarray, "*#T K"] | float
) -> tuple[Float[ndarray, "T K"], Float[ndarray, "T K"]]:
    """Heights over a floor [m] and speeds [m/s] of points.

    Args:
        points: world, z up [m].
        fps: of the frames.
        floor: height of the floor under each point: `own_floor`, `floor_nearby`, or a number [m].
    """
    return points[..., 2] - floor, np.linalg.norm(rot.linear_velocity(points, 1.0 / fps), axis=-1)


def own_floor(points: Float[ndarray, "T K 3"], percentile: float = 5.0) -> Float[ndarray, "K"]:
    """Where each point stands when it stands: a low percentile of its height [m]."""
    return np.asarray(np.percentile(points[..., 2], percentile, axis=0))


def floor_nearby(points: Float[ndarray, "T K 3"], fps: float, within_s: float) -> Float[ndarray, "T K"]:
    """The lowest that each point comes within so much time before and after [m]: a floor may drift."""
    from scipy.ndimage import minimum_filter1d

    return np.asarray(minimum_filter1d(points[..., 2], 2 * round(within_s * fps) + 1, axis=0, mode="nearest"))
