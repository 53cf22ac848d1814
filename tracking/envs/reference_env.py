"""What both Gymnasium environments have in common: a reference, its robot, and a screen."""

from __future__ import annotations

from pathlib import Path

import gymnasium
from numpy import ndarray

from clips import load_reference
from robot_models import load_robot
from tracking.envs.viewer import MODES, Screen


class ReferenceEnv(gymnasium.Env[ndarray, ndarray]):
    """An environment around one reference of one robot.

    Args:
        reference: path of a reference file.
        robot: path of the robot's profile, where it is not a built-in one.
        render_mode: None, "human" (MuJoCo's viewer) or "rgb_array" (off the screen where there is none, by EGL).
    """

    metadata = {"render_modes": list(MODES), "render_fps": 50}  # noqa: RUF012

    def __init__(self, reference: str | Path, robot: str | None, render_mode: str | None) -> None:
        path = Path(reference)
        self.robot = load_robot(robot or load_reference(path).robot)
        self.reference = load_reference(path, self.robot)
        self.metadata = {**self.metadata, "render_fps": round(self.reference.fps)}
        self.render_mode, self._screen = render_mode, Screen(self.robot, render_mode)
