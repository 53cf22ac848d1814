"""`DanceEnv-v0`: the plain dance environment of a tutorial, with that tutorial's sizes and without its faults.

Kept for people who come from there; docs/dance_env.md lists what was put right. `DanceTracking-v0` is the better task:
it observes what a robot can measure, and starts from a target that already asks for the dance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy import ndarray

from robot_models.maths import rotation as rot
from tracking.config import RandomisationConfig
from tracking.engines import MujocoBatch
from tracking.envs.reference_env import ReferenceEnv
from tracking.task import draw_robots, is_floor_work

FALLEN = 0.6  # of the root [m]
TILTED = 1.0  # roll or pitch of the root [rad]
_PHYSICS_DT = 0.005  # longest physics step [s]


class DanceEnv(ReferenceEnv):
    """A robot imitates the joint angles of a reference and stays on its feet.

    Observation, float32: qpos, qvel, the joint positions of the next reference frame, the phase in [0, 1]. For the
    28-joint dancer that is 35 + 34 + 28 + 1. Action: joint targets in [-1, 1] over the joint ranges, held by the
    robot's servos (200/10 in legs and waist, 100/5 in the arms) for one frame of the reference.
    Reward: imitation + 0.2 upright + 0.1 alive - 0.001 mean squared action; every term stands in `info`.
    `terminated`: the root is lower than 0.6 m, or rolled or pitched by more than 1 rad. `truncated`: the clip ran out.

    Args:
        reference: path of a reference file.
        robot: path of the robot's profile, where it is not a built-in one.
        render_mode: None, "human" or "rgb_array".
        noise: half width of the noise on the first pose's joints [rad].
        randomise: draw friction, mass and gains anew at every reset.
    """

    def __init__(
        self,
        reference: str | Path,
        robot: str | None = None,
        render_mode: str | None = None,
        noise: float = 0.02,
        randomise: bool = False,
    ) -> None:
        super().__init__(reference, robot, render_mode)
        self.dt, self._noise, self._randomise = 1.0 / self.reference.fps, noise, randomise
        self._qpos, self._qvel = self.reference.qpos, self.reference.qvel
        self._middle, self._half = (
            0.5 * (self.robot.lower + self.robot.upper),
            0.5 * (self.robot.upper - self.robot.lower),
        )
        joints = len(self.robot.joint_names)
        size = self._qpos.shape[1] + self._qvel.shape[1] + joints + 1
        self.observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (joints,), np.float32)
        self._physics: MujocoBatch | None = None
        self.frame = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ndarray, dict[str, Any]]:
        """Put the robot into the reference, by default at the first frame of its dance; `options={"frame": k}`."""
        super().reset(seed=seed)
        if self._physics is None or self._randomise:
            self._physics = self._draw()
        self.frame = int((options or {}).get("frame", self.reference.dance.start))
        # Copies: noise on the robot's pose shall not creep into the reference.
        qpos, qvel = self._qpos[[self.frame]].copy(), self._qvel[[self.frame]].copy()
        qpos[:, 7:] += self.np_random.uniform(-self._noise, self._noise, size=qpos[:, 7:].shape)
        self._physics.set(np.array([0]), qpos, qvel, qpos[:, 7:])
        return self._observation(), {"frame": self.frame}

    def step(self, action: ndarray) -> tuple[ndarray, float, bool, bool, dict[str, Any]]:
        """One frame of the reference."""
        if self._physics is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        action = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        self._physics.step((self._middle + self._half * action)[None])
        self.frame += 1
        qpos = self._physics.qpos[0]
        terms = self._terms(qpos, action)
        tilt = np.abs(rot.roll_pitch(qpos[3:7]))
        finite = bool(np.isfinite(self._physics.state).all())
        fallen = not finite or bool(qpos[2] < FALLEN or tilt.max() > TILTED)
        ended = self.frame >= self.reference.frames - 1 and not fallen
        if self.render_mode == "human":
            self.render()
        info = {"frame": self.frame, "reward_terms": terms}
        return self._observation(), float(sum(terms.values())), fallen, ended, info

    def render(self) -> Any:
        """A picture (height, width, 3) in mode "rgb_array"; otherwise the viewer's window is brought up to date."""
        return None if self._physics is None else self._screen.draw(self._physics.qpos[0])

    def close(self) -> None:
        """End window, renderer and threads."""
        self._screen.close()
        if self._physics is not None:
            self._physics.close()
            self._physics = None

    def _draw(self) -> MujocoBatch:
        config = RandomisationConfig(enabled=self._randomise, delay=(0.0, 0.0))
        step = self.dt / np.ceil(self.dt / _PHYSICS_DT - 1e-9)
        if self._physics is not None:
            self._physics.close()
        on_floor = is_floor_work(self.reference, self.robot)
        robots = draw_robots(self.robot, 1, step, config, self.np_random, floor_work=on_floor)
        return MujocoBatch(robots.models, control_dt=self.dt)

    def _terms(self, qpos: ndarray, action: ndarray) -> dict[str, float]:
        off = qpos[7:] - self.reference.joint_pos[min(self.frame, self.reference.frames - 1)]
        up = 1.0 - 2.0 * float(qpos[4] ** 2 + qpos[5] ** 2)  # z of the root's up axis
        return {
            "imitation": float(np.exp(-2.0 * np.square(off).sum())),
            "upright": 0.2 * up,
            "alive": 0.1,
            "effort": -0.001 * float(np.square(action).mean()),
        }

    def _observation(self) -> ndarray:
        assert self._physics is not None
        following = min(self.frame + 1, self.reference.frames - 1)
        parts = (
            self._physics.qpos[0], self._physics.qvel[0], self.reference.joint_pos[following],
            [self.frame / max(1, self.reference.frames - 1)],
        )  # fmt: skip
        return np.concatenate(parts).astype(np.float32)
