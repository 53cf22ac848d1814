"""How long a robot stands on its servos alone: the first thing to know of a new profile."""

from __future__ import annotations

import numpy as np

from robot_models.model import RobotModel

STANDS_S = 3.0
_FELL = 0.7  # of the standing height of the root


def standing_seconds(robot: RobotModel) -> float:
    """How long the robot stands in its default pose on its servos alone [s], at most three."""
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = robot.default_qpos
    data.ctrl[:] = robot.default_qpos[7:]
    steps = round(STANDS_S / model.opt.timestep)
    for step in range(steps):
        mujoco.mj_step(model, data)
        if not np.isfinite(data.qpos[2]) or data.qpos[2] < _FELL * robot.default_qpos[2]:
            return float(step * model.opt.timestep)
    return STANDS_S
