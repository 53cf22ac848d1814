"""Where a robot may be carried: the points of its soles, and whatever else of it is on the floor.

P points: the profile's contact points of the soles, the left foot's first; after them, in frames where knees, hands or
the body are down, the lowest points of their primitives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import FREE, Reference, heights_and_speeds
from retarget.rules import DynamicsConfig
from robot_models import CONTACT_NAMES, FEET, RobotModel, surface_points
from robot_models.maths import rotation as rot

_RULES = DynamicsConfig()
_MOST_PARTS = 10  # points of the body beside the soles', in one frame: a lying body rests on fewer


@dataclass(frozen=True, kw_only=True, eq=False)
class FloorPoints:
    """Points that may touch the floor, through time. T frames, P points."""

    pos_w: Float[ndarray, "T P 3"]  # [m]
    in_contact: Bool[ndarray, "T P"]  # may carry force
    yaw: Float[ndarray, "T P"]  # heading of the point's body [rad]
    body: Int[ndarray, "T P"]  # place in `body_names` of the body that carries each point

    def at(self, frames: Int[ndarray, "F"]) -> FloorPoints:
        """Some of the frames."""
        picked = {name: getattr(self, name)[frames] for name in ("pos_w", "in_contact", "yaw", "body")}
        return replace(self, **picked)


@dataclass(frozen=True, kw_only=True, eq=False)
class Carrying:
    """Which points may carry force: T frames, S sole points, K more, each a place in `surface_points` or -1."""

    soles: Bool[ndarray, "T S"]
    parts: Int[ndarray, "T K"]

    def at(self, frames: Int[ndarray, "F"]) -> Carrying:
        """Some of the frames."""
        return Carrying(soles=self.soles[frames], parts=self.parts[frames])

    @property
    def any(self) -> Bool[ndarray, "T"]:
        """Frames in which something does."""
        return np.asarray(self.soles.any(axis=1) | (self.parts >= 0).any(axis=1))

    def placed(self, robot: RobotModel, pos: Float[ndarray, "T B 3"], quat: Float[ndarray, "T B 4"]) -> FloorPoints:
        """The points in poses of the bodies."""
        soles, yaw = placed_soles(robot, pos, quat)
        body = np.broadcast_to(layout_of(robot).body, yaw.shape)
        if not self.parts.shape[1]:
            return FloorPoints(pos_w=soles, in_contact=self.soles, yaw=yaw, body=body)
        surface, part = surface_points(robot), np.maximum(self.parts, 0)
        frame, bodies = np.arange(len(pos))[:, None], surface.body[part]
        parts = pos[frame, bodies] + rot.rotate(quat[frame, bodies], surface.offset[part])
        parts[..., 2] -= surface.radius[part]
        heading = np.broadcast_to(rot.yaw(quat[:, :1]), part.shape)
        return FloorPoints(
            pos_w=np.concatenate((soles, parts), axis=1),
            in_contact=np.concatenate((self.soles, self.parts >= 0), axis=1),
            yaw=np.concatenate((yaw, heading), axis=1),
            body=np.concatenate((body, bodies), axis=1),
        )


def continuous_ranges(reference: Reference) -> list[tuple[int, int]]:
    """Half-open frame ranges that are continuous in time; nothing differentiates across their ends."""
    starts = sorted({0, *(int(s) for s, _, joined in reference.segments if not joined and s < reference.frames)})
    return list(zip(starts, [*starts[1:], reference.frames], strict=True))


def floor_points(reference: Reference, robot: RobotModel) -> FloorPoints:
    """Where a motion may be carried.

    A sole point touches if the label of its edge says that it touches, or if it is lower than 1 cm and slower than
    0.3 m/s: labels come from the source and may miss a touch. Any other part of the body touches where it is lower than
    2 cm: primitives are rounder than the robot. A point may carry force in those frames and in the ones next to them,
    because a second difference is the mean acceleration between the neighbours of its frame. Whatever is 3 cm above the
    floor carries nothing.

    Args:
        reference: the motion.
        robot: its robot.
    """
    pos, quat = reference.body_pos_w, rot.normalise(np.asarray(reference.body_quat_w, dtype=float))
    pieces = [
        carrying_points(robot, pos[a:b], quat[a:b], reference.contact[a:b], reference.fps)
        for a, b in continuous_ranges(reference)
    ]
    most = max(piece.parts.shape[1] for piece in pieces)
    parts = [np.pad(p.parts, ((0, 0), (0, most - p.parts.shape[1])), constant_values=-1) for p in pieces]
    whole = Carrying(soles=np.concatenate([p.soles for p in pieces]), parts=np.concatenate(parts))
    return whole.placed(robot, pos, quat)


@dataclass(frozen=True, kw_only=True, eq=False)
class SoleLayout:
    """The soles' contact points on the robot."""

    body: tuple[int, ...]  # place in `body_names` of the body that carries each point
    offset: Float[ndarray, "P 3"]  # in that body's frame [m]
    edge: tuple[int, ...]  # place in CONTACT_NAMES of the half sole that it lies on


@lru_cache(maxsize=16)
def layout_of(robot: RobotModel) -> SoleLayout:
    """The contact points of the profile's soles."""
    bodies, offsets, edges = [], [], []
    for side in FEET:
        sole = robot.soles[side]
        for x, y in sole.points:
            bodies.append(robot.body(sole.body))
            offsets.append((x, y, sole.z))
            edges.append(CONTACT_NAMES.index(f"{side}_{'heel' if x < 0.5 * sum(sole.x) else 'toe'}"))
    return SoleLayout(body=tuple(bodies), offset=np.array(offsets), edge=tuple(edges))


def placed_soles(
    robot: RobotModel, pos: Float[ndarray, "T B 3"], quat: Float[ndarray, "T B 4"]
) -> tuple[Float[ndarray, "T P 3"], Float[ndarray, "T P"]]:
    """Where the sole points are in poses of the bodies [m], and the heading of their feet [rad]."""
    layout = layout_of(robot)
    feet = quat[:, list(layout.body)]
    offset = np.broadcast_to(layout.offset, (*feet.shape[:2], 3))
    return pos[:, list(layout.body)] + rot.rotate(feet, offset), rot.yaw(feet)


def carrying_points(
    robot: RobotModel,
    pos: Float[ndarray, "T B 3"],
    quat: Float[ndarray, "T B 4"],
    contact: Int[ndarray, "T 4"],
    fps: float,
    airborne: Bool[ndarray, "T"] | None = None,
) -> Carrying:
    """Which points may carry force, on frames that follow one another: as `floor_points` says.

    Args:
        robot: the robot.
        pos: of its bodies [m].
        quat: of its bodies, wxyz.
        contact: labels of the sole edges.
        fps: of the frames.
        airborne: frames of jumps, in which sole points carry by their label alone.
    """
    soles, _ = placed_soles(robot, pos, quat)
    height, speed = heights_and_speeds(soles, fps, 0.0)
    still = _RULES.carrying.holds(height, speed)
    touching = (contact[:, list(layout_of(robot).edge)] != FREE) | (
        still if airborne is None else still & ~airborne[:, None]
    )
    return Carrying(soles=_beside(touching) & (height < _RULES.clear_height), parts=carrying_parts(robot, pos, quat))


def carrying_parts(
    robot: RobotModel, pos: Float[ndarray, "T B 3"], quat: Float[ndarray, "T B 4"], most: int | None = None
) -> Int[ndarray, "T K"]:
    """The lowest points of the body that are on the floor; of feet only while their soles are not.

    Args:
        robot: the robot.
        pos: of its bodies [m].
        quat: of its bodies, wxyz.
        most: K; by default as many as there are in one frame, up to ten.
    """
    surface = surface_points(robot)
    height = surface.heights(pos, quat)
    touching = height < _RULES.part_height
    for sole in robot.soles.values():
        foot = robot.body(sole.body)
        level = rot.rotate(quat[:, foot], np.array([0.0, 0.0, 1.0]))[:, 2] > _RULES.level
        touching[:, surface.body == foot] &= ~level[:, None]
    carries = _beside(touching) & (height < _RULES.clear_height)
    count = min(_MOST_PARTS, int(carries.sum(axis=1).max(initial=0))) if most is None else most
    lowest = np.argsort(np.where(carries, height, np.inf), axis=1, kind="stable")[:, :count]
    return np.where(np.take_along_axis(carries, lowest, axis=1), lowest, -1)


def _beside(touching: Bool[ndarray, "T P"]) -> Bool[ndarray, "T P"]:
    """Those and the frames next to them."""
    near = touching.copy()
    near[1:] |= touching[:-1]
    near[:-1] |= touching[1:]
    return near
