"""The per-frame back ends: one frame of targets in, one configuration out, nothing known of the future.

They are here for live input and for comparison; the report judges all solvers alike.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from retarget.config import IkConfig
from retarget.targets import Targets
from robot_models import RobotModel


@runtime_checkable
class FrameSolver(Protocol):
    """A stream: every call continues from the configuration before."""

    def __call__(self, targets: Targets, posture: Float[ndarray, "J"]) -> Float[ndarray, "nq"]:
        """The configuration for one frame of targets, near `posture` where they leave freedom."""


def reachable(
    robot: RobotModel, last: Float[ndarray, "J"] | None, config: IkConfig, fps: float
) -> tuple[Float[ndarray, "J"], Float[ndarray, "J"]]:
    """Joint bounds of the next frame: the position limits, and what the motors can reach from the last frame."""
    lower, upper = robot.ranges(config.limit_margin)
    if last is None:
        return lower, upper
    step = config.speed_share * robot.velocity / fps
    return np.maximum(lower, last - step), np.minimum(upper, last + step)
