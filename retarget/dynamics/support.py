"""Where the soles touch, and how far a point on the floor is from what they stand on.

P sole points are the profile's contact points, the left foot's first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import FREE, Reference, heights_and_speeds
from retarget.config import DynamicsConfig
from robot_models import CONTACT_NAMES, FEET, RobotModel
from robot_models.maths import rotation as rot

_RULES = DynamicsConfig()


@dataclass(frozen=True, kw_only=True, eq=False)
class SolePoints:
    """The soles' contact points through time. T frames, P points."""

    pos_w: Float[ndarray, "T P 3"]  # [m]
    in_contact: Bool[ndarray, "T P"]  # may carry force
    yaw: Float[ndarray, "T P"]  # heading of the point's foot [rad]
    body: tuple[int, ...]  # place in `body_names` of the body that carries each point

    def at(self, frames: Int[ndarray, "F"]) -> SolePoints:
        """Some of the frames."""
        return replace(self, pos_w=self.pos_w[frames], in_contact=self.in_contact[frames], yaw=self.yaw[frames])


def continuous_ranges(reference: Reference) -> list[tuple[int, int]]:
    """Half-open frame ranges that are continuous in time; nothing differentiates across their ends."""
    starts = sorted({0, *(int(s) for s, _, joined in reference.segments if not joined and s < reference.frames)})
    return list(zip(starts, [*starts[1:], reference.frames], strict=True))


def sole_points(reference: Reference, robot: RobotModel) -> SolePoints:
    """Where the sole points are and which may carry force.

    A point touches if the label of its edge says that it touches, or if it is lower than 1 cm and slower than
    0.3 m/s: labels come from the source and may miss a touch. It may carry force in those frames and in the ones next
    to them, because a second difference is the mean acceleration between the neighbours of its frame. Whatever is
    3 cm above the floor carries nothing.

    Args:
        reference: the motion.
        robot: its robot.
    """
    quat = rot.normalise(np.asarray(reference.body_quat_w, dtype=float))
    pos, yaw = placed_points(robot, reference.body_pos_w, quat)
    parts = [
        carrying_points(robot, pos[a:b], reference.contact[a:b], reference.fps) for a, b in continuous_ranges(reference)
    ]
    return SolePoints(pos_w=pos, in_contact=np.concatenate(parts), yaw=yaw, body=layout_of(robot).body)


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


def placed_points(
    robot: RobotModel, pos: Float[ndarray, "T B 3"], quat: Float[ndarray, "T B 4"]
) -> tuple[Float[ndarray, "T P 3"], Float[ndarray, "T P"]]:
    """Where the sole points are in poses of the bodies [m], and the heading of their feet [rad]."""
    layout = layout_of(robot)
    feet = quat[:, list(layout.body)]
    offset = np.broadcast_to(layout.offset, (*feet.shape[:2], 3))
    return pos[:, list(layout.body)] + rot.rotate(feet, offset), rot.yaw(feet)


def carrying_points(
    robot: RobotModel,
    pos_w: Float[ndarray, "T P 3"],
    contact: Int[ndarray, "T 4"],
    fps: float,
    airborne: Bool[ndarray, "T"] | None = None,
) -> Bool[ndarray, "T P"]:
    """Which sole points may carry force, on frames that follow one another: as `sole_points` says; airborne ones by label alone."""
    height, speed = heights_and_speeds(pos_w, fps, 0.0)
    still = _RULES.carrying.holds(height, speed)
    touching = (contact[:, list(layout_of(robot).edge)] != FREE) | (
        still if airborne is None else still & ~airborne[:, None]
    )
    near = touching.copy()
    near[1:] |= touching[:-1]
    near[:-1] |= touching[1:]
    return np.asarray(near & (height < _RULES.clear_height))


def outside_support(
    point: Float[ndarray, "T 2"], feet: Float[ndarray, "T P 2"], in_contact: Bool[ndarray, "T P"]
) -> Float[ndarray, "T"]:
    """Distance of a point on the floor from the convex hull of the touching sole points [m]; 0 inside.

    The hull's rim is made of segments between its points, and every such segment lies in it, so the least distance
    to all of them is the distance to the hull. A point is inside unless all others lie on one side of a line through
    it. Frames without a touching point or with NaN give 0.
    """
    first = np.take_along_axis(feet, in_contact.argmax(axis=1)[:, None, None], axis=1)
    corners = np.where(in_contact[..., None], feet, first)
    a, b = np.triu_indices(feet.shape[1], 1)
    start, along, to = corners[:, a], corners[:, b] - corners[:, a], point[:, None] - corners[:, a]
    share = np.clip(np.sum(to * along, axis=-1) / np.maximum(np.sum(along**2, axis=-1), 1e-18), 0.0, 1.0)
    distance = np.linalg.norm(start + share[..., None] * along - point[:, None], axis=-1).min(axis=1)
    seen = np.sort(np.arctan2(*np.moveaxis(corners - point[:, None], -1, 0)[::-1]), axis=1)
    gaps = np.diff(seen, axis=1, append=seen[:, :1] + 2.0 * np.pi)
    outside = (gaps.max(axis=1) > np.pi) & in_contact.any(axis=1) & np.isfinite(point).all(axis=1)
    return np.where(outside, distance, 0.0)
