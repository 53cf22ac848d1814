"""MuJoCo on its own rollout threads: no process per environment, no Python in the physics loop."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import TYPE_CHECKING, Unpack

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel, body_geoms
from tracking.engines.physics import EngineOptions, PhysicsBatch

if TYPE_CHECKING:
    import mujoco


def training_model(robot: RobotModel, physics_dt: float) -> mujoco.MjModel:
    """A copy of the robot for training: only soles touch, since contacts are most of the cost of a step."""
    import mujoco

    model = copy.copy(robot.model)
    geoms = body_geoms(robot)
    model.geom_contype[geoms] = 0
    model.geom_conaffinity[geoms] = 0
    model.opt.timestep = physics_dt
    model.opt.iterations = 10
    model.opt.ls_iterations = 20
    # A state that blows up shall be seen, not silently put back to the zero pose.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


class MujocoBatch(PhysicsBatch):
    """N robots in MuJoCo, at the step of their models.

    `mujoco.rollout` hands back sensors of one physics step before the state, so nothing here reads them: every
    observation is computed from the state itself.
    """

    def __init__(self, models: Sequence[mujoco.MjModel], **options: Unpack[EngineOptions]) -> None:
        """As `PhysicsBatch`."""
        import mujoco
        from mujoco import rollout

        super().__init__(models, physics_dt=models[0].opt.timestep, **options)
        # Of the full physics state all that has memory here is time, qpos and qvel; there is nothing else in it.
        model, size = self.models[0], self.state.shape[1]
        assert mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS) == size
        self._rollout = rollout.Rollout(nthread=self.threads if self.count > 1 else 0)
        self._data = [mujoco.MjData(model) for _ in range(self.threads if self.count > 1 else 1)]
        self._out = np.zeros((self.count, self.substeps, size))
        self._sensors = np.zeros((self.count, self.substeps, model.nsensordata))

    def _advance(self, targets: Float[ndarray, "N S J"]) -> None:
        self._rollout.rollout(
            self.models,
            self._data,
            self.state,
            targets,
            nstep=self.substeps,
            state=self._out,
            sensordata=self._sensors,
            skip_checks=True,  # they cost 0.7 ms a call for 256 robots, on arrays that are ours
        )
        self.state[:] = self._out[:, -1]

    def close(self) -> None:
        """End the threads."""
        self._rollout.close()
