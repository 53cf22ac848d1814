"""What a Gymnasium environment shows: MuJoCo's viewer or its off-screen renderer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from robot_models import RobotModel, draw_off_screen
from tracking.errors import TrackingError

MODES = ("human", "rgb_array")


class Screen:
    """A robot in the viewer or in pictures; opened when the first picture is asked for.

    Args:
        robot: who is shown.
        mode: None (nothing is ever shown), "human" or "rgb_array" (off the screen by EGL where there is none).
    """

    def __init__(self, robot: RobotModel, mode: str | None) -> None:
        if mode not in (None, *MODES):
            raise TrackingError("render_mode", found=repr(mode), expected="None, 'human' or 'rgb_array'")
        self._model, self._mode = robot.model, mode
        self._out: Any = None

    def draw(self, qpos: ndarray) -> ndarray | None:
        """The robot in this pose: a picture (height, width, 3), or the window brought up to date."""
        if self._mode is None:
            return None
        import mujoco

        if self._out is None:
            self._open()
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)
        if self._mode == "human":
            self._out.sync()
            return None
        self._camera.lookat[:] = [qpos[0], qpos[1], 0.75]
        self._out.update_scene(self._data, self._camera)
        return np.array(self._out.render())

    def close(self) -> None:
        """Close the window or free the renderer."""
        if self._out is not None:
            self._out.close()
            self._out = None

    def _open(self) -> None:
        import mujoco

        self._data = mujoco.MjData(self._model)
        if self._mode == "human":
            import mujoco.viewer

            self._out = mujoco.viewer.launch_passive(self._model, self._data)
            return
        draw_off_screen()
        self._out = mujoco.Renderer(self._model, 480, 640)
        self._camera = mujoco.MjvCamera()
        self._camera.distance, self._camera.azimuth, self._camera.elevation = 3.0, 150.0, -12.0
