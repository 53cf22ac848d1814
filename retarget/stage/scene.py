"""A show in viser's scene: drawn once, then moved from frame to frame. The one module that knows viser's scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from retarget.stage.show import OF_CONTACT, Arrows, Figure, Person, Show
from robot_models import FEET, surface
from robot_models.maths import smooth

SIDE_M = 1.1  # figures stand this far from each other
_PERSON, _GHOST = (90, 170, 255), (120, 170, 230)
_NOWHERE = 1e-4  # an arrow of no length [m]
_DARKEST = 0.14  # of a colour: black has no shape
_SEEN = 0.01  # of an arrow, from which it is drawn [m]
_FOLLOW_S = 0.4  # by which the camera's path is smoothed


class Scene:
    """The figures of a show in a viser scene."""

    def __init__(self, scene: Any, show: Show) -> None:
        """Draw everything at the first frame.

        Args:
            scene: `viser.ViserServer().scene`.
            show: what there is to see.
        """
        scene.set_up_direction("+z")
        scene.configure_default_lights()
        scene.configure_environment_map(None)  # the others are fetched
        scene.add_light_ambient("/ambient", intensity=0.6)
        self._world = scene.add_frame("/world", show_axes=False)
        scene.add_grid("/world/floor", width=60.0, height=60.0, cell_size=0.5, section_size=1.0,
                       cell_color=(205, 208, 214), section_color=(165, 170, 180), fade_distance=14.0)  # fmt: skip
        self._people = [_Bones(scene, f"/world/person_{k}", p) for k, p in enumerate(show.people)]
        several = any(figure.place for figure in show.figures)
        self._robots = [_Robot(scene, f"/world/figure_{k}", f, several) for k, f in enumerate(show.figures)]
        self._arrows = [_Arrows(scene, f"/world/forces_{k}", a) for k, a in enumerate(show.arrows)]
        root = show.figures[0].body_pos_w[:, 0]
        self._way = np.zeros_like(root)
        self._way[:, :2] = smooth(root[:, :2], show.fps, _FOLLOW_S)
        self._follows = True
        self.stand_apart(True)
        self.go_to(0)

    def follow(self, on: bool) -> None:
        """Whether the world passes under the first figure, or the figure through the world."""
        self._follows = on

    def stand_apart(self, on: bool) -> None:
        """Side by side, or over one another."""
        for person in self._people:
            person.root.position = (0.0, SIDE_M * on, 0.0)
        for robot in self._robots:
            robot.root.position = (0.0, SIDE_M * robot.figure.place * on, 0.0)

    def show_people(self, on: bool) -> None:
        """The person, or not."""
        for person in self._people:
            person.shown(on)

    def show_forces(self, on: bool) -> None:
        """The forces, or not."""
        for arrows in self._arrows:
            arrows.handle.visible = on

    def show_soles(self, on: bool) -> None:
        """The colours of the contacts, or not."""
        for robot in self._robots:
            for sole in robot.soles:
                sole.visible = on

    def show_ghosts(self, on: bool) -> None:
        """Where a robot should be, or not."""
        for robot in self._robots:
            if robot.figure.ghost:
                robot.root.visible = on

    def go_to(self, frame: int) -> None:
        """Move everything to a frame of the show."""
        self._world.position = -self._way[min(frame, len(self._way) - 1)] * self._follows
        movers: tuple[_Robot | _Bones | _Arrows, ...] = (*self._people, *self._robots, *self._arrows)
        for mover in movers:
            mover.go_to(frame)


class _Robot:
    """Bodies as frames, their surface and soles below them."""

    def __init__(self, scene: Any, path: str, figure: Figure, named: bool) -> None:
        self.figure = figure
        self.root = scene.add_frame(path, show_axes=False)
        names = figure.robot.body_names
        self._bodies = [scene.add_frame(f"{path}/{name}", show_axes=False) for name in names]
        for k, piece in enumerate(surface(figure.robot)):
            red, green, blue, _ = (round(255 * max(c, _DARKEST)) for c in piece.rgba)
            scene.add_mesh_simple(
                f"{path}/{piece.body}/surface_{k}",
                piece.vertices.astype(np.float32), piece.faces.astype(np.uint32),
                color=_GHOST if figure.ghost else (red, green, blue),
                opacity=0.3 if figure.ghost else None, cast_shadow=not figure.ghost,
            )  # fmt: skip
        self.soles = [] if figure.contact is None else _draw_soles(scene, path, figure)
        self._kinds: Sequence[int] = (-1,) * 4
        label = scene.add_label(
            f"{path}/{names[0]}/name", figure.name, position=(0.0, 0.0, 0.75), anchor="bottom-center"
        )
        label.visible = named

    def go_to(self, frame: int) -> None:
        t = min(frame, len(self.figure.body_pos_w) - 1)
        for body, pos, quat in zip(self._bodies, self.figure.body_pos_w[t], self.figure.body_quat_w[t], strict=True):
            body.position, body.wxyz = pos, quat
        if self.figure.contact is not None:
            kinds = self.figure.contact[t].tolist()
            for sole, kind, before in zip(self.soles, kinds, self._kinds, strict=True):
                if kind != before:
                    sole.color = OF_CONTACT[kind]
            self._kinds = kinds


def _draw_soles(scene: Any, path: str, figure: Figure) -> list[Any]:
    """Half soles: heel and toe of the left foot, then of the right."""
    out = []
    for side in FEET:
        sole = figure.robot.soles[side]
        middle = 0.5 * sum(sole.x)
        for edge, x in (("heel", (sole.x[0], middle)), ("toe", (middle, sole.x[1]))):
            out.append(
                scene.add_box(
                    f"{path}/{sole.body}/{edge}",
                    dimensions=(x[1] - x[0], sole.y[1] - sole.y[0], 0.012),
                    position=(0.5 * sum(x), 0.5 * sum(sole.y), sole.z + 0.006),
                )
            )
    return out


class _Bones:
    """A person as lines."""

    def __init__(self, scene: Any, path: str, person: Person) -> None:
        self._person = person
        self.root = scene.add_frame(path, show_axes=False)
        self._lines = scene.add_line_segments(
            f"{path}/bones", person.bones_w[0].astype(np.float32), colors=_PERSON, thickness=0.028
        )
        self._on = True

    def shown(self, on: bool) -> None:
        self._on = on
        self.root.visible = on

    def go_to(self, frame: int) -> None:
        t = frame - self._person.begins
        there = 0 <= t < len(self._person.bones_w)
        if there:
            self._lines.points = self._person.bones_w[t].astype(np.float32)
        if self.root.visible != (there and self._on):
            self.root.visible = there and self._on


class _Arrows:
    """Forces, always as many; what is too small to see has no length."""

    def __init__(self, scene: Any, path: str, arrows: Arrows) -> None:
        self._points = _from_to(arrows).astype(np.float32)
        self.handle = scene.add_arrows(
            path, self._points[0], colors=arrows.colour, shaft_radius=0.012, head_radius=0.028, head_length=0.06
        )

    def go_to(self, frame: int) -> None:
        points = self._points[min(frame, len(self._points) - 1)]
        if not np.array_equal(points, self.handle.points):
            self.handle.points = points


def _from_to(arrows: Arrows) -> ndarray:
    """(T, K, 2, 3)."""
    small = np.linalg.norm(arrows.along_w, axis=2, keepdims=True) < _SEEN
    tail = np.where(small, [0.0, 0.0, -5.0], arrows.tail_w)
    along = np.where(small, [0.0, 0.0, _NOWHERE], arrows.along_w)
    return np.stack((tail, tail + along), axis=2)
