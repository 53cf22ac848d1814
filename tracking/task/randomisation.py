"""A robot of its own for every environment, drawn from the ranges of `RandomisationConfig`, and pushes on the way."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel
from robot_models.maths import Array, array_namespace
from robot_models.maths import rotation as rot
from tracking.config import RandomisationConfig
from tracking.engines import Rng, floor_geoms, limit_torque_by_speed, training_model

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, kw_only=True, eq=False)
class Robots:
    """What differs between the robots of N environments."""

    models: list[mujoco.MjModel]
    encoder_bias: Float[ndarray, "N J"]  # [rad]
    imu: Float[ndarray, "N 4"]  # root_from_imu, beyond the nominal mounting
    delay: Float[ndarray, "N"]  # from sensor to motor [s]


def draw_robots(
    robot: RobotModel,
    count: int,
    physics_dt: float,
    config: RandomisationConfig,
    rng: np.random.Generator,
    *,
    floor_work: bool = False,
) -> Robots:
    """`count` robots; all of them nominal where randomisation is off. Of floor work see `training_model`."""
    base, joints = training_model(robot, physics_dt, floor_work=floor_work), len(robot.joint_names)
    if not config.enabled:
        straight = np.tile(rot.IDENTITY, (count, 1))
        return Robots(
            models=[base] * count, encoder_bias=np.zeros((count, joints)), imu=straight, delay=np.zeros(count)
        )
    drawn = Robots(
        models=[_drawn(base, robot, config, rng) for _ in range(count)],
        encoder_bias=rng.uniform(-config.encoder_bias, config.encoder_bias, size=(count, joints)),
        delay=rng.uniform(*config.delay, size=count),
        imu=rot.exp(rng.uniform(-config.imu_mounting, config.imu_mounting, size=(count, 3))),
    )
    for model in drawn.models if config.torque_speed else ():
        knee, no_load = rng.uniform(*config.knee), rng.uniform(*config.no_load)
        limit_torque_by_speed(model, knee * robot.velocity, no_load * robot.velocity)
    return drawn


def _drawn(
    base: mujoco.MjModel, robot: RobotModel, config: RandomisationConfig, rng: np.random.Generator
) -> mujoco.MjModel:
    model = copy.copy(base)
    model.geom_friction[floor_geoms(model), 0] = rng.uniform(*config.friction)
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


class Pushes:
    """Sudden changes of the root's velocity, each robot's at its own times."""

    def __init__(
        self,
        count: int,
        dt: float,
        config: RandomisationConfig,
        rng: Rng,
        to_device: Callable[[ndarray], Array] = np.asarray,
    ) -> None:
        self._width = to_device(np.array((*config.push_linear, *config.push_angular)))
        self._pause = config.push_every[0] / dt, config.push_every[1] / dt
        self.strength = 1.0 if config.enabled and config.pushes else 0.0  # of the widths
        self.wait = self._draw(count, rng)  # control periods until the next

    def apply(self, qvel: Float[Array, "N nv"], rng: Rng) -> None:
        """Let one control period pass and push, in place, whose time has come."""
        self.wait -= 1.0
        due = array_namespace(self.wait).where(self.wait <= 0.0)[0]
        if len(due):
            qvel[due, :6] += self.strength * rng.uniform(-self._width, self._width, size=(len(due), 6))
            self.wait[due] = self._draw(len(due), rng)

    def _draw(self, count: int, rng: Rng) -> Float[Array, "n"]:
        return rng.uniform(self._pause[0], self._pause[1], size=count)
