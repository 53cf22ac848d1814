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


def training_model(robot: RobotModel, physics_dt: float, *, floor_work: bool = False) -> mujoco.MjModel:
    """A copy of the robot for training: its bodies pass through each other, which is most of the cost of a step.

    Args:
        robot: the robot.
        physics_dt: step of the physics [s].
        floor_work: whether its whole body meets the floor, of its feet the soles; otherwise only these do.
    """
    import mujoco

    model = copy.copy(robot.model)
    geoms, soles = body_geoms(robot), sole_geoms(model)
    model.geom_contype[geoms] = 0
    model.geom_conaffinity[geoms] = 0
    if floor_work:
        feet = set(model.geom_bodyid[soles].tolist())
        geoms = [g for g in geoms if model.geom_bodyid[g] not in feet]
        for array in ("geom_conaffinity", "geom_friction", "geom_priority", "geom_condim"):
            getattr(model, array)[geoms] = getattr(model, array)[soles[0]]
        model.body_conaffinity[model.geom_bodyid[geoms]] |= model.geom_conaffinity[soles[0]]
    model.opt.timestep = physics_dt
    model.opt.iterations = 10
    model.opt.ls_iterations = 20
    # A state that blows up shall be seen, not silently put back to the zero pose.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


def sole_geoms(model: mujoco.MjModel) -> list[int]:
    """The spheres of a model's soles."""
    return [g for g in range(model.ngeom) if "_sole_" in (model.geom(g).name or "")]


def floor_geoms(model: mujoco.MjModel) -> list[int]:
    """Geoms of the robot that meet the floor."""
    kind = model.geom_conaffinity[sole_geoms(model)[0]]
    return [g for g in range(model.ngeom) if model.geom_bodyid[g] and model.geom_conaffinity[g] & kind]


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
