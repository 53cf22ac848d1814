"""Many robots at once in a physics engine: what the tracking task asks of any engine, and nothing else."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol, Required, TypedDict, Unpack, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models import BodyStates, RobotModel
from robot_models.maths import Array, array_namespace, available_threads, push_history
from tracking.engines.body_sensors import BodySensors
from tracking.engines.random import Rng
from tracking.errors import TrackingError

if TYPE_CHECKING:
    import mujoco


@runtime_checkable
class BodyReader(Protocol):
    """Tells poses and velocities of bodies in the states of N robots."""

    @property
    def states(self) -> BodyStates:
        """World poses and velocities as they were last read."""

    def read(self, state: Float[Array, "N S"]) -> None:
        """Read the bodies of all robots from their states."""

    def read_some(self, ids: Int[Array, "n"], state: Float[Array, "n S"]) -> None:
        """Read the bodies of some robots; the others stay as they were last read."""

    def close(self) -> None:
        """End what keeps running."""


class EngineOptions(TypedDict, total=False):
    """What every engine is made with, besides its models."""

    control_dt: Required[float]  # control period [s], a whole number of physics steps
    delay: Float[ndarray, "N"] | None  # until each robot's motors hear of a new target, rounded to physics steps [s]
    threads: int  # of the physics, where the engine has threads; 0: as many as the process may use


class PhysicsBatch(ABC):
    """N robots, each with a model of its own, advanced together by one control period.

    Args:
        models: the robots. Masses, inertias, joints, motors, soles and friction are read from these in every engine.
        physics_dt: physics step [s].
        options: control period, delays and threads.

    `state` is [time, qpos, qvel] in MuJoCo's layout and conventions. `qpos` and `qvel` are views of its parts. Arrays are
    NumPy's in main memory, unless an engine says otherwise by `to_device`: the task computes where the engine does.
    """

    device = "cpu"  # as torch names it: where the arrays are

    def __init__(
        self, models: Sequence[mujoco.MjModel], *, physics_dt: float, **options: Unpack[EngineOptions]
    ) -> None:
        self.models, self.physics_dt = list(models), physics_dt
        self.threads = options.get("threads", 0) or available_threads()
        control_dt, delay = options["control_dt"], options.get("delay")
        self.substeps = round(control_dt / physics_dt)
        if abs(self.substeps * physics_dt - control_dt) > 1e-9 or self.substeps < 1:
            raise TrackingError(
                "control period", found=f"{control_dt} s over physics steps of {physics_dt} s",
                expected="a whole number of them",
            )  # fmt: skip
        model = self.models[0]
        self._nq, self._nv = int(model.nq), int(model.nv)
        self.state = self.to_device(np.zeros((self.count, 1 + self._nq + self._nv)))
        waits = np.zeros(self.count) if delay is None else delay
        # The targets of this period and of those before, newest first, as far back as the longest delay reaches.
        longest = round(float(waits.max()) / physics_dt)
        self.targets = self.to_device(np.zeros((self.count, 1 - (-longest // self.substeps), model.nu)))
        self._robots = self.to_device(np.arange(self.count)[:, None])
        self._substep = self.to_device(np.arange(self.substeps))
        self.set_delay(self.to_device(waits))

    def to_device(self, values: ndarray) -> Array:
        """The values where this engine computes, as its arrays are."""
        return values

    def make_rng(self, rng: np.random.Generator) -> Rng:
        """A generator of random numbers there, which goes on from this one."""
        return rng

    def body_sensors(self, robot: RobotModel, bodies: list[int], threads: int) -> BodyReader:
        """What tells where bodies are and how they move; they are places in `body_names`."""
        return BodySensors(robot, bodies, self.count, threads)

    @property
    def count(self) -> int:
        """Number of robots N."""
        return len(self.models)

    @property
    def qpos(self) -> Float[Array, "N nq"]:
        """Root position [m], root wxyz, joints [rad]; a view."""
        return self.qpos_of(self.state)

    @property
    def qvel(self) -> Float[Array, "N nv"]:
        """Root linear velocity (world), root angular velocity (body), joint velocities; a view."""
        return self.qvel_of(self.state)

    def qpos_of(self, state: Float[Array, "*any S"]) -> Float[Array, "*any nq"]:
        """The part of a full physics state that is qpos; a view."""
        return state[..., 1 : 1 + self._nq]

    def qvel_of(self, state: Float[Array, "*any S"]) -> Float[Array, "*any nv"]:
        """The part of a full physics state that is qvel; a view."""
        return state[..., 1 + self._nq : 1 + self._nq + self._nv]

    def set_delay(self, delay: Float[Array, "N"]) -> None:
        """Change how many seconds late the motors hear; not beyond the longest delay of the beginning."""
        xp = array_namespace(delay)
        steps = xp.asarray(xp.round(delay / self.physics_dt), dtype=xp.int64)
        self._which = -(-xp.clip(steps[:, None] - self._substep, 0, None) // self.substeps)

    def set(
        self, ids: Array, qpos: Float[Array, "n nq"], qvel: Float[Array, "n nv"], targets: Float[Array, "n J"]
    ) -> None:
        """Put some robots into a state, in which they have been asked for some joint targets [rad]."""
        self.state[ids] = 0.0
        self.qpos[ids], self.qvel[ids] = qpos, qvel
        self.targets[ids] = targets[:, None]

    def step(self, targets: Float[Array, "N J"]) -> None:
        """Advance all robots by one control period, holding the joint targets [rad]."""
        push_history(self.targets.swapaxes(0, 1), targets)
        self._advance(self.targets[self._robots, self._which])

    @abstractmethod
    def _advance(self, targets: Float[Array, "N S J"]) -> None:
        """Move `state` on by S physics steps under each one's joint targets."""

    def close(self) -> None:  # noqa: B027 - most engines keep nothing running
        """End what the engine keeps running."""


Engine = Callable[..., PhysicsBatch]
"""What makes a batch: called as the constructor of `PhysicsBatch` is, with `threads` besides."""
