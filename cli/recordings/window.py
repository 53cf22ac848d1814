"""Poses in MuJoCo's viewer, in real time, again and again until it is closed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from clips import OutputError
from robot_models import has_display

if TYPE_CHECKING:
    from numpy import ndarray

    from tracking.evaluation import PoseStream


def show_live(show: PoseStream) -> int:
    """In a window, in real time; returns the number of frames that there were.

    The camera follows the robot, and a policy's reference stands pale in its place. After the end, or the fall, what was seen
    begins again.
    """
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

    from retarget.recordings import as_it_looks

    model = as_it_looks(show.robot)
    data, ghost = mujoco.MjData(model), mujoco.MjData(model)
    seen: list[tuple[ndarray, ndarray | None]] = []
    with mujoco.viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False) as window:
        with window.lock():
            window.cam.type = mujoco.mjtCamera.mjCAMERA_TRACKING
            window.cam.trackbodyid, window.cam.distance, window.cam.elevation, window.cam.azimuth = 1, 3.0, -12.0, 150.0
        due = time.perf_counter()
        for qpos, meant in _again(show, seen):
            if not window.is_running():
                return show.frames if len(seen) < show.frames else len(seen)  # closed by hand: nobody fell
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            with window.lock():
                window.user_scn.ngeom = 0
                if meant is not None:
                    ghost.qpos[:] = meant
                    _add_ghost(mujoco, model, ghost, window.user_scn)
            window.sync()
            due = max(due + 1.0 / show.fps, time.perf_counter() - 1.0)
            time.sleep(max(0.0, due - time.perf_counter()))
    return len(seen)


def _again(show: PoseStream, seen: list[tuple[ndarray, ndarray | None]]) -> Iterator[tuple[ndarray, ndarray | None]]:
    """The poses as they come, kept in `seen`, and then these without end."""
    for pose in show.poses:
        seen.append(pose)
        yield pose
    while True:
        yield from seen


def _add_ghost(mujoco: Any, model: Any, data: Any, scene: Any) -> None:
    """The robot in another pose, pale and transparent."""
    from retarget.recordings import veil

    mujoco.mj_forward(model, data)
    moving = int(mujoco.mjtCatBit.mjCAT_DYNAMIC)
    mujoco.mjv_addGeoms(model, data, mujoco.MjvOption(), mujoco.MjvPerturb(), moving, scene)
    veil(scene.geoms[: scene.ngeom])
