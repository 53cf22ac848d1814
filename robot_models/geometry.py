"""Where the robot's surface is: lowest point over the floor and self-collision depth, from its primitives."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models.build import BODY_BIT
from robot_models.maths import rotation as rot
from robot_models.model import RobotModel
from robot_models.rigid_body import sole_corners

if TYPE_CHECKING:
    import mujoco


def lowest_point(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T"]:
    """Height of the lowest point of soles and body primitives over the floor z = 0 [m]."""
    return np.asarray(lowest_points(robot, body_pos_w, body_quat_w).min(axis=1))


def lowest_points(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T B"]:
    """The same for each body [m]; infinite for one without a surface."""
    lowest = np.full(body_pos_w.shape[:2], np.inf)
    corners = sole_corners(robot, body_pos_w, body_quat_w)[..., 2].min(axis=2)
    for foot, sole in enumerate(robot.soles.values()):
        lowest[:, robot.body(sole.body)] = corners[:, foot]
    place = {b: i for i, b in enumerate(robot.body_ids)}
    for geom in body_geoms(robot):
        body = place.get(int(robot.model.geom_bodyid[geom]))
        if body is not None:
            bottom = _geom_bottom(robot.model, geom, body_pos_w[:, body], body_quat_w[:, body])
            lowest[:, body] = np.minimum(lowest[:, body], bottom)
    return lowest


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfacePoints:
    """Where the primitives of a robot's bodies may touch the floor: N spheres (of no radius: corners) fixed to bodies."""

    body: Int[ndarray, "N"]  # place in `body_names`
    offset: Float[ndarray, "N 3"]  # of the centre in the body's frame [m]
    radius: Float[ndarray, "N"]  # [m]

    def heights(self, pos: Float[ndarray, "T B 3"], quat: Float[ndarray, "T B 4"]) -> Float[ndarray, "T N"]:
        """Of their lowest points over z = 0 [m]."""
        up = rot.to_matrix(quat)[:, :, 2]
        return np.asarray(pos[:, self.body, 2] + (up[:, self.body] * self.offset).sum(axis=2) - self.radius)


@lru_cache(maxsize=16)
def surface_points(robot: RobotModel) -> SurfacePoints:
    """The ends of capsules, the corners of boxes, the rims of cylinders, the middles of spheres and the like."""
    import mujoco

    m, place = robot.model, {b: i for i, b in enumerate(robot.body_ids)}
    bodies, offsets, radii = list[int](), list[ndarray](), list[float]()
    ends = np.array([(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    around = np.arange(8) * np.pi / 4.0
    rim = np.array([(np.cos(a), np.sin(a), z) for a in around for z in (-1.0, 1.0)])
    for geom in body_geoms(robot):
        body = int(m.geom_bodyid[geom])
        frame = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        while body not in place:  # welded to one that is
            frame = (
                m.body_pos[body] + rot.rotate(m.body_quat[body], frame[0]),
                rot.multiply(m.body_quat[body], frame[1]),
            )
            body = int(m.body_parentid[body])
        size, kind = m.geom_size[geom], m.geom_type[geom]
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            points, radius = ends * size[1], float(size[0])
        elif kind == mujoco.mjtGeom.mjGEOM_BOX:
            points, radius = corners * size, 0.0
        elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
            points, radius = rim * (size[0], size[0], size[1]), 0.0
        else:
            points, radius = np.zeros((1, 3)), float(size[0])
        points = m.geom_pos[geom] + rot.rotate(m.geom_quat[geom], points)
        bodies += [place[body]] * len(points)
        offsets += list(frame[0] + rot.rotate(frame[1], points))
        radii += [radius] * len(points)
    return SurfacePoints(
        body=np.array(bodies, dtype=int), offset=np.array(offsets).reshape(-1, 3), radius=np.array(radii)
    )


def body_geoms(robot: RobotModel) -> list[int]:
    """Ids of the primitives that stand for the robot's own surface."""
    return [g for g in range(robot.model.ngeom) if robot.model.geom_contype[g] & BODY_BIT]


def _geom_bottom(model: mujoco.MjModel, geom: int, pos: ndarray, quat: ndarray) -> ndarray:
    """Lowest z of one primitive: centre minus its support in the direction of gravity."""
    import mujoco

    frames = len(pos)
    centre = pos + rot.rotate(quat, np.broadcast_to(model.geom_pos[geom], (frames, 3)))
    world_from_geom = rot.multiply(quat, np.broadcast_to(model.geom_quat[geom], (frames, 4)))
    down = np.abs(rot.to_matrix(world_from_geom)[:, 2, :])
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        reach = down @ size
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        reach = size[0] + down[:, 2] * size[1]
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        reach = size[0] * np.sqrt(np.maximum(1.0 - down[:, 2] ** 2, 0.0)) + down[:, 2] * size[1]
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        reach = np.linalg.norm(down * size, axis=1)
    else:
        reach = np.full(frames, size[0])
    return np.asarray(centre[:, 2] - reach)


@dataclass(frozen=True, kw_only=True, eq=False)
class SelfCollisions:
    """The deepest overlap of two of the robot's own bodies in every frame."""

    depth: Float[ndarray, "T"]  # [m], 0 where none touch
    bodies: tuple[tuple[str, str] | None, ...]  # MuJoCo's names of the two
    point_w: Float[ndarray, "T 3"]  # where they meet [m]; NaN where they do not


def self_collisions(robot: RobotModel, qpos: Float[ndarray, "T nq"]) -> SelfCollisions:
    """MuJoCo's own collision pass: parents with their children and the profile's excluded pairs do not count."""
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    depth, point_w = np.zeros(len(qpos)), np.full((len(qpos), 3), np.nan)
    bodies: list[tuple[str, str] | None] = [None] * len(qpos)
    # A loop: MuJoCo's broad phase works on one state at a time.
    for t, q in enumerate(qpos):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        geoms = data.contact.geom
        overlap = np.where((model.geom_contype[geoms] & BODY_BIT).all(axis=1), -data.contact.dist, 0.0)
        k = int(overlap.argmax()) if len(overlap) else -1
        if k >= 0 and overlap[k] > 0.0:
            a, b = (model.body(int(i)).name for i in model.geom_bodyid[geoms[k]])
            depth[t], bodies[t], point_w[t] = overlap[k], (a, b), data.contact.pos[k]
    return SelfCollisions(depth=depth, bodies=tuple(bodies), point_w=point_w)
