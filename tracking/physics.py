"""Many robots at once on MuJoCo's own rollout threads: no process per environment, no Python in the physics loop."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
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

    Args:
        models: the robots.
        control_dt: control period [s], a whole number of physics steps.
        delay: physics steps until each robot's motors hear of a new target; none by default.
        threads: of the physics; 0: as many as the process may use.

    `qpos` and `qvel` are the state after the last step. `mujoco.rollout` hands back sensors of one physics step
    before that, so nothing here reads them: every observation is computed from the state itself.
    """

    def __init__(
        self,
        models: Sequence[mujoco.MjModel],
        *,
        control_dt: float,
        delay: Int[ndarray, "N"] | None = None,
        threads: int = 0,
    ) -> None:
        import mujoco
        from mujoco import rollout

        self.models = list(models)
        model = self.models[0]
        self.substeps = round(control_dt / model.opt.timestep)
        if abs(self.substeps * model.opt.timestep - control_dt) > 1e-9 or self.substeps < 1:
            raise TrackingError(
                "control period", found=f"{control_dt} s over physics steps of {model.opt.timestep} s",
                expected="a whole number of them",
            )  # fmt: skip
        threads = threads or available_threads()
        self._rollout = rollout.Rollout(nthread=threads if len(self.models) > 1 else 0)
        self._data = [mujoco.MjData(model) for _ in range(max(1, threads if len(self.models) > 1 else 1))]
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        size = mujoco.mj_stateSize(model, kind)
        # Of the full physics state [time, qpos, qvel, ...] all that has memory here is time, qpos and qvel.
        self._nq, self._nv = int(model.nq), int(model.nv)
        self.state = np.zeros((len(self.models), size))
        self._out = np.zeros((len(self.models), self.substeps, size))
        self._sensors = np.zeros((len(self.models), self.substeps, model.nsensordata))
        self.controls = np.zeros((len(self.models), self.substeps, model.nu))
        waits = np.zeros(self.count, dtype=int) if delay is None else delay
        # The targets of this period and of those before, newest first, as far back as the longest delay reaches.
        self.targets = np.zeros((self.count, 1 - (-int(waits.max()) // self.substeps), model.nu))
        self.set_delay(waits)

    @property
    def count(self) -> int:
        """Number of robots N."""
        return len(self.models)

    @property
    def qpos(self) -> Float[ndarray, "N nq"]:
        """Root position [m], root wxyz, joints [rad]; a view."""
        return self.qpos_of(self.state)

    @property
    def qvel(self) -> Float[ndarray, "N nv"]:
        """Root linear velocity (world), root angular velocity (body), joint velocities; a view."""
        return self.qvel_of(self.state)

    def qpos_of(self, state: Float[ndarray, "*any S"]) -> Float[ndarray, "*any nq"]:
        """The part of a full physics state that is qpos; a view."""
        return state[..., 1 : 1 + self._nq]

    def qvel_of(self, state: Float[ndarray, "*any S"]) -> Float[ndarray, "*any nv"]:
        """The part of a full physics state that is qvel; a view."""
        return state[..., 1 + self._nq : 1 + self._nq + self._nv]

    def set_delay(self, delay: Int[ndarray, "N"]) -> None:
        """Change how many physics steps late the motors hear; not beyond the longest delay of the beginning."""
        late = np.maximum(delay[:, None] - np.arange(self.substeps), 0)
        self._which = -(-late // self.substeps)[..., None]

    def set(
        self, ids: ndarray, qpos: Float[ndarray, "n nq"], qvel: Float[ndarray, "n nv"], targets: Float[ndarray, "n J"]
    ) -> None:
        """Put some robots into a state, in which they have been asked for some joint targets [rad]."""
        self.state[ids] = 0.0
        self.qpos[ids], self.qvel[ids] = qpos, qvel
        self.targets[ids] = targets[:, None]

    def step(self, targets: Float[ndarray, "N J"]) -> None:
        """Advance all robots by one control period, holding the joint targets [rad]."""
        self.targets[:, 1:] = self.targets[:, :-1]
        self.targets[:, 0] = targets
        self.controls[:] = np.take_along_axis(self.targets, self._which, axis=1)
        self._rollout.rollout(
            self.models,
            self._data,
            self.state,
            self.controls,
            nstep=self.substeps,
            state=self._out,
            sensordata=self._sensors,
            skip_checks=False,
        )
        self.state[:] = self._out[:, -1]

    def close(self) -> None:
        """End the threads."""
        self._rollout.close()
