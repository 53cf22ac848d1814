"""The tracking task as a Gymnasium environment: `gymnasium.make("DanceTracking-v0", reference="out.npz")`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy import ndarray

from tracking.config import TaskConfig
from tracking.envs.reference_env import ReferenceEnv
from tracking.task import TrackingTask


class DanceTrackingEnv(ReferenceEnv):
    """One robot that shall follow a reference.

    Observation: the actor's table (`env.unwrapped.task.actor`), float32. Action: residual joint targets in [-1, 1], in
    units of `task.action_scale` rad. Reward: the task's terms times the control period; each stands in
    `info["reward_terms"]`.
    `terminated`: the robot fell or lost the dance. `truncated`: the reference ran out.

    Args:
        reference: path of a reference file.
        robot: path of the robot's profile, where it is not a built-in one.
        render_mode: None, "human" (MuJoCo's viewer) or "rgb_array" (off the screen where there is none, by EGL).
        config: the task's numbers.
        random_start: start anywhere in the dance; otherwise at its first frame.
    """

    def __init__(
        self,
        reference: str | Path,
        robot: str | None = None,
        render_mode: str | None = None,
        config: TaskConfig | None = None,
        random_start: bool = True,
    ) -> None:
        super().__init__(reference, robot, render_mode)
        self.task = TrackingTask(
            robot=self.robot, reference=self.reference, envs=1, config=config or TaskConfig(), threads=1
        )
        self.random_start = random_start
        self.observation_space = spaces.Box(-np.inf, np.inf, (self.task.actor.size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (self.task.actions,), np.float32)
        self._seeded = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ndarray, dict[str, Any]]:
        """Put the robot into the reference; `options={"frame": k}` chooses where."""
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            # Without a seed every copy of the environment begins differently.
            self.task.rng = np.random.default_rng(seed)
            self._seeded = True
        frame = (options or {}).get("frame", None if self.random_start else int(self.task.tables.openings[0]))
        self.task.reset(np.array([0]), None if frame is None else np.array([int(frame)]))
        return self._observation(), {"frame": int(self.task.frame[0])}

    def step(self, action: ndarray) -> tuple[ndarray, float, bool, bool, dict[str, Any]]:
        """One control period."""
        result = self.task.step(np.asarray(action, dtype=np.float64)[None])
        info = {
            "frame": int(self.task.frame[0]),
            "reward_terms": {k: float(v[0]) for k, v in result.terms.items()},
            "causes": [k for k, v in result.causes.items() if v[0]],
        }
        if self.render_mode == "human":
            self.render()
        return self._observation(), float(result.reward[0]), bool(result.terminated[0]), bool(result.truncated[0]), info

    def render(self) -> Any:
        """A picture (height, width, 3) in mode "rgb_array"; otherwise the viewer's window is brought up to date."""
        return self._screen.draw(self.task.physics.qpos[0])

    def close(self) -> None:
        """End window, renderer and threads."""
        self._screen.close()
        self.task.close()

    def _observation(self) -> ndarray:
        return self.task.observe()[0][0]
