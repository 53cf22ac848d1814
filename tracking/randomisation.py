"""A robot of its own for every environment, drawn from the ranges of `RandomisationConfig`."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from robot_models import RobotModel
from tracking.config import RandomisationConfig
from tracking.physics import training_model

if TYPE_CHECKING:
    import mujoco


def make_models(
    robot: RobotModel, count: int, physics_dt: float, config: RandomisationConfig, rng: np.random.Generator
) -> list[mujoco.MjModel]:
    """Models of `count` robots; all the same where randomisation is off."""
    base = training_model(robot, physics_dt)
    if not config.enabled:
        return [base] * count
    return [_drawn(base, robot, config, rng) for _ in range(count)]


def _drawn(
    base: mujoco.MjModel, robot: RobotModel, config: RandomisationConfig, rng: np.random.Generator
) -> mujoco.MjModel:
    model = copy.copy(base)
    soles = [g for g in range(model.ngeom) if "_sole_" in (model.geom(g).name or "")]
    model.geom_friction[soles, 0] = rng.uniform(*config.friction)
    factor = rng.uniform(*config.mass, size=model.nbody)
    model.body_mass[:] *= factor
    model.body_inertia[:] *= factor[:, None]
    torso = robot.body_ids[robot.body(robot.profile.anchor)]
    model.body_ipos[torso] += rng.uniform(-config.torso_com, config.torso_com, size=3)
    kp, kd = (rng.uniform(*config.gains, size=model.nu) for _ in range(2))
    # MuJoCo's position servo: force = gainprm[0] ctrl + biasprm[1] q + biasprm[2] qdot.
    model.actuator_gainprm[:, 0] *= kp
    model.actuator_biasprm[:, 1] *= kp
    model.actuator_biasprm[:, 2] *= kd
    return model
