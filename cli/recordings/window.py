"""Poses in MuJoCo's viewer, in real time."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from clips import OutputError
from robot_models import has_display

if TYPE_CHECKING:
    from tracking.evaluation import PoseStream


def show_live(show: PoseStream) -> int:
    """In a window, in real time; returns the number of frames shown."""
    import mujoco

    if not has_display():
        raise OutputError(
            "viewer",
            found="no display",
            expected="one",
            cure="watch it in a browser (dance-view), or write a film",
            option="film",
            suggestion="out.mp4",
        )
    import mujoco.viewer

    data, shown = mujoco.MjData(show.robot.model), 0
    with mujoco.viewer.launch_passive(show.robot.model, data) as window:
        began = time.perf_counter()
        for shown, (qpos, _) in enumerate(show.poses, start=1):
            if not window.is_running():
                return show.frames  # closed by hand: nobody fell
            data.qpos[:] = qpos
            mujoco.mj_forward(show.robot.model, data)
            window.sync()
            time.sleep(max(0.0, began + shown / show.fps - time.perf_counter()))
    return shown
