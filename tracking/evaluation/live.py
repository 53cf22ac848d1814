"""A policy dancing one control period at a time, on a robot that can be hindered and pushed while one looks on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.maths import rotation as rot
from tracking.config import RandomisationConfig, StartNoise, TaskConfig
from tracking.evaluation.rollouts import play, start
from tracking.policy import load_bundle
from tracking.task import FALLS, TrackingTask


@dataclass(frozen=True, kw_only=True)
class Hindrance:
    """What the robot and its floor are like."""

    friction: float = 1.0  # of the soles
    mass: float = 1.0  # factor on every body
    delay_s: float = 0.0  # from sensor to motor [s]

    def task(self) -> TaskConfig:
        """The task with one such robot, its sensors noisy, pushed by nobody but who looks on."""
        drawn = replace(
            RandomisationConfig(), friction=(self.friction,) * 2, mass=(self.mass,) * 2, delay=(self.delay_s,) * 2,
            gains=(1.0, 1.0), torso_com=0.0, encoder_bias=0.0, imu_mounting=0.0, pushes=False,
        )  # fmt: skip
        return TaskConfig(start_noise=StartNoise(scale=0.0), randomisation=drawn)


class LiveDance:
    """The policy of a bundle and its robot, from the first frame of the reference to the fall or the end, and again."""

    def __init__(
        self, path: Path, robot: str | None = None, seed: int = 1, reference: Path | None = None,
        hindrance: Hindrance = Hindrance(),
    ) -> None:  # fmt: skip
        """Begin.

        Args:
            path: as for `load_bundle`.
            robot: as for `load_bundle`.
            seed: of the sensors' noise.
            reference: as for `load_bundle`.
            hindrance: what the robot is like.

        Raises:
            TrackingError: no bundle, or parts that do not belong together.
        """
        self._bundle, self._seed = load_bundle(path, reference=reference, robot=robot), seed
        self.robot, self.reference = self._bundle.robot, self._bundle.reference
        self.falls, self.fell, self.frame = 0, False, 0
        self._task: TrackingTask | None = None
        self.restart(hindrance)

    @property
    def qpos(self) -> Float[ndarray, "nq"]:
        """Of the robot, now."""
        assert self._task is not None
        return np.array(self._task.physics.qpos[0])

    @property
    def over(self) -> bool:
        """Whether it fell or came to the end."""
        return self.fell or self.frame >= self.reference.frames - 1

    @property
    def off_mm(self) -> float:
        """How far its bodies are from the reference, root-relative, on average."""
        assert self._task is not None
        away = self._task.sensors.states.pos[0] - self._task.tables.pos[self.frame]
        return 1e3 * float(np.linalg.norm(away - away[:1], axis=-1).mean())

    def restart(self, hindrance: Hindrance | None = None) -> None:
        """Begin with the reference's first frame, on another robot where one is named."""
        if hindrance is not None or self._task is None:
            self.close()
            task = (hindrance or Hindrance()).task()
            self._task = TrackingTask(
                robot=self.robot, reference=self.reference, envs=1, config=task, seed=self._seed, threads=1
            )
        self._task.reset(np.array([0]), np.array([0]))
        start(self._bundle.runner, self._task, 0)
        self.frame, self.fell = 0, False

    def step(self) -> None:
        """One control period; a fall is counted."""
        assert self._task is not None
        causes = play(self._bundle.runner, self._task).causes
        self.frame += 1
        if any(causes[fall][0] for fall in FALLS):
            self.fell = True
            self.falls += 1

    def push(self, forward: float, left: float) -> None:
        """Change the velocity of the root at once, by so much in its own heading [m/s]."""
        assert self._task is not None
        qvel, quat = self._task.physics.qvel, self._task.physics.qpos[0, 3:7]
        heading = rot.from_yaw(rot.yaw(quat))
        qvel[0, :3] += rot.rotate(heading, np.array([forward, left, 0.0]))

    def close(self) -> None:
        """End the threads."""
        if self._task is not None:
            self._task.close()
