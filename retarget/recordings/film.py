"""A film of a dancing robot, drawn by MuJoCo off the screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from clips import OutputError, aside
from retarget.recordings.sound import add_sound, encoder
from robot_models import RobotError, RobotModel, draw_off_screen, model_to_look_at, surface, visual_parts
from robot_models.maths import Progress, silent

_FPS = 25.0  # as films are shown; twice as many take twice as long to draw
_BLOB_M, _BLOB_FADES_M = 0.14, 0.15  # radius of a foot's blob on the floor, and the foot's height at which it is gone
_NEAREST_M = 3.4  # from where two who stand side by side are both seen
_GHOST = (0.35, 0.75, 1.0, 0.3)


def write_film(
    path: Path,
    robot: RobotModel,
    poses: Iterator[tuple[ndarray, ndarray | None]],
    fps: float,
    size: tuple[int, int],
    *,
    title: str = "",
    song: Path | None = None,
    song_at_s: float = 0.0,
    frames: int = 0,
    progress: Progress = silent,
) -> int:
    """Write an mp4 of poses with their ghosts; returns the number of poses.

    Args:
        path: the film; whole or absent.
        robot: who dances.
        poses: qpos of the robot and of its ghost (None: no ghost), frame by frame.
        fps: of the poses.
        size: width and height in pixels, even numbers.
        title: stands in a corner, with the seconds.
        song: to be heard under it.
        song_at_s: as for `add_sound`.
        frames: how many poses there can be, for those who are told of the progress.
        progress: told after every pose.

    Raises:
        OutputError: no OpenGL or no encoder on this machine, or the file cannot be written.
    """
    if min(size) < 16 or any(s % 2 for s in size):
        raise OutputError("film", found=f"a size of {size[0]}x{size[1]}", expected="even numbers of pixels, from 16 on")
    imageio = encoder()
    stage, every, done = Stage(robot, size, shadows=False), max(1, round(fps / _FPS)), 0
    with aside(path) as beside:
        film = imageio.write_frames(str(beside), size, fps=fps / every, codec="libx264", quality=7, macro_block_size=2)
        film.send(None)
        for done, (qpos, ghost) in enumerate(poses, start=1):
            if (done - 1) % every == 0:
                picture = _titled(stage.draw(qpos, ghost), f"{title}  {(done - 1) / fps:.1f} s".strip())
                film.send(np.ascontiguousarray(picture))
            progress("film", done, frames)
        film.close()
        stage.close()
        if song is not None:
            add_sound(beside, song, song_at_s)
    return done


def _as_it_looks(robot: RobotModel) -> Any:
    """The robot's model with its meshes where there are any, and something to thin them out; else with primitives."""
    if not any(part.kind == "mesh" for part in visual_parts(robot)):
        return robot.model
    try:
        return model_to_look_at(robot, surface(robot))
    except RobotError:
        return robot.model


def _titled(picture: ndarray, text: str) -> ndarray:
    """The picture with a line of text in its lower left corner."""
    from PIL import Image, ImageDraw, ImageFont  # comes with Rerun

    image, size = Image.fromarray(picture), max(12, picture.shape[0] // 36)
    place = size, picture.shape[0] - 2 * size
    font = ImageFont.load_default(size)
    ImageDraw.Draw(image).text(place, text, fill=(255, 255, 255), font=font, stroke_width=1, stroke_fill=(0, 0, 0))
    return np.asarray(image)


Bone = tuple[ndarray, ndarray, float, ndarray]
"""From [m], to [m], radius [m], colour (rgba)."""


class Stage:
    """MuJoCo's renderer with a camera that follows the robot, the ghost as a veil, and a person of bones.

    Shadows are half the time of a picture without a GPU; without them a blob lies under each foot, darker the lower it is.
    """

    def __init__(self, robot: RobotModel, size: tuple[int, int], *, shadows: bool = True) -> None:
        draw_off_screen()
        import mujoco

        self._mj, self._model = mujoco, _as_it_looks(robot)
        self._data, self._ghost = mujoco.MjData(self._model), mujoco.MjData(self._model)
        self._model.vis.global_.offwidth, self._model.vis.global_.offheight = size
        try:
            self._renderer = mujoco.Renderer(self._model, size[1], size[0])
        except Exception as e:  # every GL backend raises its own types
            raise OutputError(
                "film", found=f"no OpenGL to draw with ({type(e).__name__}: {e})", expected="EGL, OSMesa or a display",
                cure="set MUJOCO_GL to egl or osmesa, or watch the Rerun recording",
            ) from e  # fmt: skip
        self._blobs = [] if shadows else [(self._model.body(s.body).id, -s.z) for s in robot.soles.values()]
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._camera, self._look = mujoco.MjvCamera(), np.full(3, np.nan)
        self._camera.distance, self._camera.azimuth, self._camera.elevation = 2.7, 150.0, -8.0

    def look_at(self, place: ndarray, height: float) -> None:
        """Turn the camera at once to a place on the floor and a height over it, from the front."""
        self._look = np.array([*place, 0.9 * height])
        self._camera.distance, self._camera.azimuth = max(3.2 * height, _NEAREST_M), 180.0

    def _add_ghost(self, qpos: ndarray) -> None:
        """The robot in another pose, pale and transparent."""
        mj, scene = self._mj, self._renderer.scene
        self._ghost.qpos[:] = qpos
        mj.mj_forward(self._model, self._ghost)
        first = scene.ngeom
        mj.mjv_addGeoms(
            self._model, self._ghost, mj.MjvOption(), mj.MjvPerturb(), int(mj.mjtCatBit.mjCAT_DYNAMIC), scene
        )
        for g in scene.geoms[first : scene.ngeom]:
            g.rgba[:], g.matid, g.transparent = _GHOST, -1, 1

    def _add_blobs(self) -> None:
        """What stands for the shadow of each foot."""
        mj, scene = self._mj, self._renderer.scene
        for body, stands in self._blobs:  # and how high a foot's origin is while it stands [m]
            x, y, z = self._data.xpos[body]
            dark = 0.5 * float(np.clip(1.0 - (z - stands) / _BLOB_FADES_M, 0.0, 1.0))
            size, at = np.array([_BLOB_M, _BLOB_M, 1e-3]), np.array([x, y, 2e-3])
            geom, rgba = scene.geoms[scene.ngeom], np.array([0.0, 0.0, 0.0, dark], dtype=np.float32)
            mj.mjv_initGeom(geom, mj.mjtGeom.mjGEOM_ELLIPSOID, size, at, np.eye(3).ravel(), rgba)
            geom.transparent = 1
            scene.ngeom += 1

    def draw(self, qpos: ndarray, ghost: ndarray | None, bones: Sequence[Bone] = ()) -> ndarray:
        """One picture (height, width, 3)."""
        mj, scene = self._mj, self._renderer.scene
        self._data.qpos[:] = qpos
        mj.mj_forward(self._model, self._data)
        aim = np.array([qpos[0], qpos[1], 0.75])
        if not bones:
            # The camera trails, so that steps are seen as steps.
            self._look = aim if np.isnan(self._look).any() else self._look + 0.12 * (aim - self._look)
        self._camera.lookat[:] = self._look
        self._renderer.update_scene(self._data, self._camera)
        self._add_blobs()
        if ghost is not None:
            self._add_ghost(ghost)
        for start, end, radius, rgba in bones:
            geom = scene.geoms[scene.ngeom]
            mj.mjv_initGeom(
                geom, mj.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9), rgba.astype(np.float32)
            )
            mj.mjv_connector(geom, mj.mjtGeom.mjGEOM_CAPSULE, radius, start, end)
            scene.ngeom += 1
        return np.asarray(self._renderer.render())

    def close(self) -> None:
        """Give the renderer back."""
        self._renderer.close()
