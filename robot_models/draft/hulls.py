"""Soles and self-collision capsules from a robot's surface: what a profile needs where a model file has only meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.maths import rotation as rot
from robot_models.profile import Capsule
from robot_models.visual import mesh_parts

if TYPE_CHECKING:
    import mujoco

_SKIN = 0.004  # of the lowest vertices of a foot, which make its sole [m]
_INSET = 0.95  # of the sole's length and width that is flat
_TIGHT = 0.85  # of a link's half width that its capsule takes: capsules inside the skin touch where the skin does
_SLIGHT = 0.02  # links thinner than this need no capsule [m]


def surface_points(path: Path, bodies: Sequence[str]) -> dict[str, Float[ndarray, "V 3"]]:
    """Points on every body's surface, in its frame: meshes where they are found, else primitives; {} without any."""
    import mujoco

    found: dict[str, list[ndarray]] = {}
    if path.suffix.lower() == ".urdf":
        for part in mesh_parts(bodies, path):
            if part.vertices is not None:
                found.setdefault(part.body, []).append(part.vertices)
    if not found:
        try:
            model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError:  # meshes that are not there, or a package:// path
            return {}
        for geom in range(model.ngeom):
            body = _moving_body(model, int(model.geom_bodyid[geom]))
            name = model.body(body).name
            if body > 0 and name in bodies:
                found.setdefault(name, []).append(_in_body(model, geom, body))
    return {name: np.concatenate(points) for name, points in found.items()}


def _moving_body(model: mujoco.MjModel, body: int) -> int:
    while body > 0 and model.body_jntnum[body] == 0 and model.body_parentid[body] > 0:
        body = int(model.body_parentid[body])
    return body


def _in_body(model: mujoco.MjModel, geom: int, body: int) -> Float[ndarray, "V 3"]:
    """Points of one geom in the frame of the moving body that carries it."""
    import mujoco

    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        points = np.array(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], dtype=float)
    else:
        # The box around it, which for the foot plates that matter here is the geom itself.
        centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        points = centre + half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    pos, quat = np.array(model.geom_pos[geom]), np.array(model.geom_quat[geom])
    at = int(model.geom_bodyid[geom])
    points = pos + rot.rotate(np.broadcast_to(quat, (len(points), 4)), points)
    while at != body:
        turn = np.broadcast_to(model.body_quat[at], (len(points), 4))
        points, at = model.body_pos[at] + rot.rotate(turn, points), int(model.body_parentid[at])
    return points


def sole_of(
    points: Float[ndarray, "V 3"], skin: float = _SKIN
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Back and front, right and left edge, and height of the flat under a foot, in the foot's frame [m]."""
    z = float(points[:, 2].min())
    low = points[points[:, 2] < z + skin]
    middle, half = 0.5 * (low.max(axis=0) + low.min(axis=0)), 0.5 * _INSET * np.ptp(low, axis=0)
    x, y = ((float(middle[k] - half[k]), float(middle[k] + half[k])) for k in (0, 1))
    return x, y, z


def capsules_of(points: Mapping[str, Float[ndarray, "V 3"]], bodies: Sequence[str]) -> list[Capsule]:
    """One capsule inside the skin of every body that is thick enough, along its longest side."""
    capsules = []
    for body in bodies:
        if body not in points:
            continue
        low, high = points[body].min(axis=0), points[body].max(axis=0)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        along = int(np.argmax(half))
        radius = _TIGHT * float(np.min(np.delete(half, along)))
        if radius < _SLIGHT:
            continue
        reach = max(0.0, float(half[along]) - radius)
        ends = [middle.copy(), middle.copy()]
        ends[0][along] -= reach
        ends[1][along] += reach
        (ax, ay, az), (bx, by, bz) = ([round(float(v), 4) for v in e] for e in ends)
        capsules.append(
            Capsule(name=f"{body}_capsule", body=body, start=(ax, ay, az), end=(bx, by, bz), radius=round(radius, 4))
        )
    return capsules
