"""Where the robot's surface is: lowest point over the floor and self-collision depth, from its primitives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.build import BODY_BIT
from robot_models.kinematics import sole_corners
from robot_models.maths import rotation as rot
from robot_models.model import RobotModel

if TYPE_CHECKING:
    import mujoco


def lowest_point(
    robot: RobotModel, body_pos_w: Float[ndarray, "T B 3"], body_quat_w: Float[ndarray, "T B 4"]
) -> Float[ndarray, "T"]:
    """Height of the lowest point of soles and body primitives over the floor z = 0 [m]."""
    lowest = sole_corners(robot, body_pos_w, body_quat_w)[..., 2].min(axis=(1, 2))
    place = {b: i for i, b in enumerate(robot.body_ids)}
    for geom in body_geoms(robot):
        body = place.get(int(robot.model.geom_bodyid[geom]))
        if body is not None:
            lowest = np.minimum(lowest, _geom_bottom(robot.model, geom, body_pos_w[:, body], body_quat_w[:, body]))
    return np.asarray(lowest)


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


def self_collision_depth(robot: RobotModel, qpos: Float[ndarray, "T nq"]) -> Float[ndarray, "T"]:
    """Deepest overlap of two of the robot's own bodies per frame, 0 where none touch [m].

    MuJoCo's own collision pass: parents with their children and the profile's excluded pairs do not count.
    """
    return np.array([max((d for _, d in found), default=0.0) for found in _overlaps(robot, qpos)])


def _overlaps(robot: RobotModel, qpos: ndarray) -> Iterator[list[tuple[tuple[int, int], float]]]:
    """Overlapping pairs of the robot's own primitives with their depths [m], frame by frame."""
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    # A loop: MuJoCo's broad phase works on one state at a time.
    for q in qpos:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        geoms, depth = data.contact.geom, -data.contact.dist
        own = (model.geom_contype[geoms] & BODY_BIT).all(axis=1) & (depth > 0.0)
        yield [((int(a), int(b)), float(d)) for (a, b), d in zip(geoms[own], depth[own], strict=True)]
