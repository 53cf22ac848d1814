"""Many robots at once in a physics engine: what the tracking task asks of any engine, and nothing else."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from tracking.errors import TrackingError

if TYPE_CHECKING:
    import mujoco


class PhysicsBatch(ABC):
    """N robots, each with a model of its own, advanced together by one control period.

    Args:
        models: the robots. Masses, inertias, joints, motors, soles and friction are read from these in every engine.
        control_dt: control period [s], a whole number of physics steps.
        physics_dt: physics step [s].
        delay: seconds until each robot's motors hear of a new target, rounded to physics steps; none by default.

    `state` is [time, qpos, qvel] in MuJoCo's layout and conventions. `qpos` and `qvel` are views of its parts.
    """

    def __init__(
        self,
        models: Sequence[mujoco.MjModel],
        *,
        control_dt: float,
        physics_dt: float,
        delay: Float[ndarray, "N"] | None = None,
    ) -> None:
        self.models, self.physics_dt = list(models), physics_dt
        self.substeps = round(control_dt / physics_dt)
        if abs(self.substeps * physics_dt - control_dt) > 1e-9 or self.substeps < 1:
            raise TrackingError(
                "control period", found=f"{control_dt} s over physics steps of {physics_dt} s",
                expected="a whole number of them",
            )  # fmt: skip
        model = self.models[0]
        self._nq, self._nv = int(model.nq), int(model.nv)
        self.state = np.zeros((self.count, 1 + self._nq + self._nv))
        waits = np.zeros(self.count) if delay is None else delay
        # The targets of this period and of those before, newest first, as far back as the longest delay reaches.
        longest = round(float(waits.max()) / physics_dt)
        self.targets = np.zeros((self.count, 1 - (-longest // self.substeps), model.nu))
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

    def set_delay(self, delay: Float[ndarray, "N"]) -> None:
        """Change how many seconds late the motors hear; not beyond the longest delay of the beginning."""
        steps = np.round(delay / self.physics_dt).astype(int)
        late = np.maximum(steps[:, None] - np.arange(self.substeps), 0)
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
        self._advance(np.take_along_axis(self.targets, self._which, axis=1))

    @abstractmethod
    def _advance(self, targets: Float[ndarray, "N S J"]) -> None:
        """Move `state` on by S physics steps under each one's joint targets."""

    def close(self) -> None:  # noqa: B027 - most engines keep nothing running
        """End what the engine keeps running."""


Engine = Callable[..., PhysicsBatch]
"""What makes a batch: called as the constructor of `PhysicsBatch` is, with `threads` besides."""
