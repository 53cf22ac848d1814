"""MuJoCo's renderer, off the screen: a robot, its ghost, who stands beside it, a camera that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import OutputError
from robot_models import FEET, RobotError, RobotModel, draw_off_screen, model_to_look_at, surface, visual_parts

_BLOB_M, _BLOB_FADES_M = 0.14, 0.15  # radius of a foot's blob on the floor, and the foot's height at which it is gone
_BOTH_M = 4.3  # from where a person of 1.8 m with raised arms and a robot are seen
_NEAREST_M = 3.4  # from where two who stand side by side are both seen
_GHOST = (0.35, 0.75, 1.0, 0.3)
_TOUCHES = (0.2, 0.85, 0.45)
_TRAILS = 0.12  # of the way to where it shall look, that the camera goes from one picture to the next


def as_it_looks(robot: RobotModel) -> Any:
    """The robot's model with its meshes where there are any, and something to thin them out; else with primitives."""
    if not any(part.kind == "mesh" for part in visual_parts(robot)):
        return robot.model
    try:
        return model_to_look_at(robot, surface(robot))
    except RobotError:
        return robot.model


Bone = tuple[ndarray, ndarray, float, ndarray]
"""From [m], to [m], radius [m], colour (rgba)."""


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Shot:
    """What one picture shows."""

    qpos: Float[ndarray, "nq"]  # of the robot
    ghost: Float[ndarray, "nq"] | None = None  # the same robot, pale: where it shall be
    beside: Float[ndarray, "nq"] | None = None  # the same robot once more, solid
    bones: Sequence[Bone] = ()  # of a person
    touches: tuple[bool, bool] = (False, False)  # which foot touches the floor


def veil(shapes: Sequence[Any]) -> None:
    """Make shapes of a scene pale and transparent: a ghost's."""
    for shape in shapes:
        shape.rgba[:], shape.matid, shape.transparent = _GHOST, -1, 1


class Stage:
    """MuJoCo's renderer with a camera that follows the robot, the ghost as a veil, and a person of bones.

    Shadows are half the time of a picture without a GPU; without them a blob lies under each foot, darker the lower it is, and
    green while the foot touches.
    """

    def __init__(self, robot: RobotModel, size: tuple[int, int], *, shadows: bool = True) -> None:
        draw_off_screen()
        import mujoco

        self._mj, self._model = mujoco, as_it_looks(robot)
        self._data, self._other = mujoco.MjData(self._model), mujoco.MjData(self._model)
        self._model.vis.global_.offwidth, self._model.vis.global_.offheight = size
        try:
            self._renderer = mujoco.Renderer(self._model, size[1], size[0])
        except Exception as e:  # every GL backend raises its own types
            raise OutputError(
                "film", found=f"no OpenGL to draw with ({type(e).__name__}: {e})", expected="EGL, OSMesa or a display",
                cure="set MUJOCO_GL to egl or osmesa, or watch the Rerun recording",
            ) from e  # fmt: skip
        soles = [robot.soles[side] for side in FEET]
        self._blobs = [] if shadows else [(self._model.body(s.body).id, -s.z) for s in soles]
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._camera, self._look = mujoco.MjvCamera(), np.full(3, np.nan)
        self._camera.distance, self._camera.azimuth, self._camera.elevation = 2.7, 150.0, -8.0
        self._follows, self._aside = True, np.zeros(2)

    def look_at(self, place: ndarray, height: float) -> None:
        """Turn the camera at once to a place on the floor and a height over it, from the front, and leave it there."""
        self._look, self._follows = np.array([*place, 0.9 * height]), False
        self._camera.distance, self._camera.azimuth = max(3.2 * height, _NEAREST_M), 180.0

    def look_beside(self, aside: ndarray, width_m: float) -> None:
        """Follow the robot from the front, looking a way to its side, so that all who stand in some width are seen."""
        self._aside, self._camera.azimuth = aside, 180.0
        self._camera.distance = max(_BOTH_M, 1.5 * width_m + 1.6)

    def draw(self, shot: Shot) -> ndarray:
        """One picture (height, width, 3)."""
        mj = self._mj
        self._data.qpos[:] = shot.qpos
        mj.mj_forward(self._model, self._data)
        if self._follows:
            aim = np.array([*(shot.qpos[:2] + self._aside), 0.75])
            # The camera trails, so that steps are seen as steps.
            self._look = aim if np.isnan(self._look).any() else self._look + _TRAILS * (aim - self._look)
        self._camera.lookat[:] = self._look
        self._renderer.update_scene(self._data, self._camera)
        self._add_blobs(self._data, shot.touches)
        if shot.beside is not None:
            self._add_robot(shot.beside)
            self._add_blobs(self._other, (False, False))
        if shot.ghost is not None:
            veil(self._add_robot(shot.ghost))
        for start, end, radius, rgba in shot.bones:
            geom = self._add(mj.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
            mj.mjv_connector(geom, mj.mjtGeom.mjGEOM_CAPSULE, radius, start, end)
        return np.asarray(self._renderer.render())

    def _add_robot(self, qpos: ndarray) -> Sequence[Any]:
        """The robot in another pose; its shapes."""
        mj, scene = self._mj, self._renderer.scene
        self._other.qpos[:] = qpos
        mj.mj_forward(self._model, self._other)
        first, moving = scene.ngeom, int(mj.mjtCatBit.mjCAT_DYNAMIC)
        mj.mjv_addGeoms(self._model, self._other, mj.MjvOption(), mj.MjvPerturb(), moving, scene)
        return scene.geoms[first : scene.ngeom]

    def _add_blobs(self, data: Any, touches: tuple[bool, bool]) -> None:
        """What stands for the shadow of each foot."""
        for (body, stands), touching in zip(
            self._blobs, touches, strict=False
        ):  # and how high its origin is while it stands [m]
            x, y, z = data.xpos[body]
            dark = 0.5 * float(np.clip(1.0 - (z - stands) / _BLOB_FADES_M, 0.0, 1.0))
            rgba = np.array([*_TOUCHES, 0.6] if touching else [0.0, 0.0, 0.0, dark])
            size, at = np.array([_BLOB_M, _BLOB_M, 1e-3]), np.array([x, y, 2e-3])
            geom = self._add(self._mj.mjtGeom.mjGEOM_ELLIPSOID, size, at, np.eye(3).ravel(), rgba)
            geom.transparent = 1

    def _add(self, kind: Any, size: ndarray, at: ndarray, turn: ndarray, rgba: ndarray) -> Any:
        scene = self._renderer.scene
        geom = scene.geoms[scene.ngeom]
        self._mj.mjv_initGeom(geom, kind, size, at, turn, rgba.astype(np.float32))
        scene.ngeom += 1
        return geom

    def close(self) -> None:
        """Give the renderer back."""
        self._renderer.close()
