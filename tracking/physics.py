"""Many robots at once on MuJoCo's own rollout threads: no process per environment, no Python in the physics loop."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel
from robot_models.surface import body_geoms
from tracking.errors import TrackingError

if TYPE_CHECKING:
    import mujoco


def available_threads() -> int:
    """Cores that this process may use, which in a container are fewer than the machine's."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


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


class PhysicsBatch:
    """N robots, each with a model of its own, advanced together by one control period.

    `qpos` and `qvel` are the state after the last step. `mujoco.rollout` hands back sensors of one physics step
    before that, so nothing here reads them: every observation is computed from the state itself.
    """

    def __init__(self, models: Sequence[mujoco.MjModel], *, control_dt: float, threads: int = 0) -> None:
        import mujoco
        from mujoco import rollout

        self._models = list(models)
        model = self._models[0]
        self.substeps = round(control_dt / model.opt.timestep)
        if abs(self.substeps * model.opt.timestep - control_dt) > 1e-9 or self.substeps < 1:
            raise TrackingError(
                "control period", found=f"{control_dt} s over physics steps of {model.opt.timestep} s",
                expected="a whole number of them",
            )  # fmt: skip
        threads = threads or available_threads()
        self._rollout = rollout.Rollout(nthread=threads if len(self._models) > 1 else 0)
        self._data = [mujoco.MjData(model) for _ in range(max(1, threads if len(self._models) > 1 else 1))]
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        size = mujoco.mj_stateSize(model, kind)
        # Of the full physics state [time, qpos, qvel, ...] all that has memory here is time, qpos and qvel.
        self._nq, self._nv = int(model.nq), int(model.nv)
        self.state = np.zeros((len(self._models), size))
        self._out = np.zeros((len(self._models), self.substeps, size))
        self._sensors = np.zeros((len(self._models), self.substeps, model.nsensordata))
        self._controls = np.zeros((len(self._models), self.substeps, model.nu))

    @property
    def count(self) -> int:
        """Number of robots N."""
        return len(self._models)

    @property
    def qpos(self) -> Float[ndarray, "N nq"]:
        """Root position [m], root wxyz, joints [rad]; a view."""
        return self.state[:, 1 : 1 + self._nq]

    @property
    def qvel(self) -> Float[ndarray, "N nv"]:
        """Root linear velocity (world), root angular velocity (body), joint velocities; a view."""
        return self.state[:, 1 + self._nq : 1 + self._nq + self._nv]

    def set(self, ids: ndarray, qpos: Float[ndarray, "n nq"], qvel: Float[ndarray, "n nv"]) -> None:
        """Put some robots into a state."""
        self.state[ids] = 0.0
        self.qpos[ids], self.qvel[ids] = qpos, qvel

    def step(self, targets: Float[ndarray, "N J"]) -> None:
        """Advance all robots by one control period, holding the joint targets [rad]."""
        self._controls[:] = targets[:, None, :]
        self._rollout.rollout(
            self._models,
            self._data,
            self.state,
            self._controls,
            nstep=self.substeps,
            state=self._out,
            sensordata=self._sensors,
            skip_checks=False,
        )
        self.state[:] = self._out[:, -1]

    def close(self) -> None:
        """End the threads."""
        self._rollout.close()
