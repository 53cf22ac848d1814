"""Which stream solves frame by frame, and every frame sent through it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from retarget.config import IkConfig
from retarget.errors import RetargetError
from retarget.per_frame.base import FrameSolver
from retarget.targets import Targets
from robot_models import RobotModel
from robot_models.maths import Progress, silent


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
    solver: FrameSolver, targets: Targets, posture: Float[ndarray, "T J"], *, progress: Progress = silent
) -> Float[ndarray, "T nq"]:
    """Send every frame through a stream."""
    out = []
    for t in range(len(posture)):
        out.append(solver(targets.at(np.array([t])), posture[t]))
        progress("frame by frame", t + 1, len(posture))
    return np.stack(out)
