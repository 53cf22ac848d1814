"""The per-frame back ends: one frame of targets in, one configuration out, nothing known of the future.

They are here for live input and for comparison; the report judges all solvers alike.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from retarget.config import IkConfig
from retarget.errors import RetargetError
from retarget.targets import Targets
from robot_models import RobotModel

Progress = Callable[[int, int], None]  # frames done, frames in all


@runtime_checkable
class FrameSolver(Protocol):
    """A stream: every call continues from the configuration before."""

    def __call__(self, targets: Targets, posture: Float[ndarray, "J"]) -> Float[ndarray, "nq"]:
        """The configuration for one frame of targets, near `posture` where they leave freedom."""


def frame_solver(name: str, robot: RobotModel, config: IkConfig, fps: float) -> FrameSolver:
    """The back end of that name: mink or placo.

    Raises:
        RetargetError: there is none of that name.
    """
    if name == "mink":
        from retarget.per_frame.mink import MinkIk

        return MinkIk(robot, config, fps)
    if name == "placo":
        from retarget.per_frame.placo import PlacoIk

        return PlacoIk(robot, config, fps)
    raise RetargetError(
        "solver", found=repr(name), expected="whole-clip, mink or placo", option="solver", suggestion="whole-clip"
    )


def follow(
    solver: FrameSolver, targets: Targets, posture: Float[ndarray, "T J"], *, progress: Progress | None = None
) -> Float[ndarray, "T nq"]:
    """Send every frame through a stream."""
    out = []
    for t in range(len(posture)):
        out.append(solver(targets.at(np.array([t])), posture[t]))
        if progress is not None:
            progress(t + 1, len(posture))
    return np.stack(out)


def reachable(
    robot: RobotModel, last: Float[ndarray, "J"] | None, config: IkConfig, fps: float
) -> tuple[Float[ndarray, "J"], Float[ndarray, "J"]]:
    """Joint bounds of the next frame: the position limits, and what the motors can reach from the last frame."""
    lower, upper = robot.ranges(config.limit_margin)
    if last is None:
        return lower, upper
    step = config.speed_share * robot.velocity / fps
    return np.maximum(lower, last - step), np.minimum(upper, last + step)
