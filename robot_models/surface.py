"""A robot's surface as few triangles: one mesh for each body and colour, alone or as a model to look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models.build import dress
from robot_models.errors import RobotError, import_or_refuse
from robot_models.maths import rotation as rot
from robot_models.model import RobotModel
from robot_models.model_file import read_spec
from robot_models.rigid_body import forward_kinematics
from robot_models.visual import Part, visual_parts

if TYPE_CHECKING:
    import mujoco

_BONE, _BONE_M = (0.6, 0.62, 0.66, 1.0), 0.02  # colour and radius of a rod [m]
_HIDDEN = 4  # group of geoms that MuJoCo does not draw
_FACES = 900  # of one mesh, at most: a robot of 35 and more in 46,000, which any laptop turns


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Triangles in a body's frame."""

    body: str
    rgba: tuple[float, float, float, float]
    vertices: Float[ndarray, "V 3"]  # [m]
    faces: Int[ndarray, "F 3"]


@lru_cache(maxsize=8)
def surface(robot: RobotModel) -> tuple[Piece, ...]:
    """Its meshes, thinned out, where they are installed; else its primitives, and rods for bodies that have none.

    Raises:
        RobotError: meshes, and nothing installed that thins them out.
    """
    groups: dict[tuple[str, tuple[float, float, float, float]], list[tuple[ndarray, ndarray]]] = {}
    for part in visual_parts(robot):
        groups.setdefault((part.body, part.rgba), []).append(_triangles(part))
    dressed = {body for body, _ in groups}
    for body, rods in _bones(robot).items():
        if body not in dressed:
            groups[body, _BONE] = rods
    return tuple(_joined(body, rgba, meshes) for (body, rgba), meshes in groups.items())


def _bones(robot: RobotModel) -> dict[str, list[tuple[ndarray, ndarray]]]:
    """Rods from every body to those that it carries, for robots that have no surface."""
    import trimesh

    pos, quat = (a[0] for a in forward_kinematics(robot, robot.zero_qpos[None]))
    found: dict[str, list[tuple[ndarray, ndarray]]] = {}
    for k in range(1, len(robot.body_names)):
        above = int(robot.model.body_parentid[robot.body_ids[k]])
        while robot.place_of_body[above] < 0:
            above = int(robot.model.body_parentid[above])
        parent = int(robot.place_of_body[above])
        to = rot.rotate(rot.conjugate(quat[parent]), pos[k] - pos[parent])
        if np.linalg.norm(to) > _BONE_M:
            rod = trimesh.creation.cylinder(_BONE_M, segment=[np.zeros(3), to], sections=12)
            found.setdefault(robot.body_names[parent], []).append((np.asarray(rod.vertices), np.asarray(rod.faces)))
    return found


def model_to_look_at(robot: RobotModel, pieces: Sequence[Piece]) -> mujoco.MjModel:
    """A model of the same qpos and bodies with a surface of meshes; primitives stay where a body has none.

    Args:
        robot: the robot.
        pieces: of its surface.
    """
    import mujoco

    spec = read_spec(robot.profile)
    dressed = {piece.body for piece in pieces}
    dress(spec, robot.profile)
    for geom in spec.geoms:
        if geom.parent.name in dressed:
            geom.group = _HIDDEN
    for k, piece in enumerate(pieces):
        mesh = spec.add_mesh(name=f"surface_{k}", uservert=piece.vertices.ravel(), userface=piece.faces.ravel())
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # a thin one has no volume
        spec.body(piece.body).add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name, mass=0, contype=0, conaffinity=0, rgba=piece.rgba, group=0
        )  # fmt: skip
    return spec.compile()


def _joined(body: str, rgba: tuple[float, float, float, float], meshes: list[tuple[ndarray, ndarray]]) -> Piece:
    first = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = np.concatenate([f + k for (_, f), k in zip(meshes, first[:-1], strict=True)])
    return Piece(body=body, rgba=rgba, vertices=np.concatenate([v for v, _ in meshes]), faces=faces)


def _triangles(part: Part) -> tuple[ndarray, ndarray]:
    import trimesh

    shape = trimesh.creation
    if part.kind == "mesh":
        return _thinned(np.asarray(part.vertices), np.asarray(part.faces))
    if part.kind == "box":
        mesh = shape.box(2.0 * part.size)
    elif part.kind == "cylinder":
        mesh = shape.cylinder(part.size[0], 2.0 * part.size[1], sections=24)
    elif part.kind == "capsule":
        mesh = shape.capsule(2.0 * part.size[1], part.size[0], count=[16, 16])
        mesh.vertices -= mesh.bounds.mean(axis=0)  # trimesh's begins at its origin, MuJoCo's is about it
    else:
        mesh = shape.icosphere(subdivisions=2)
        mesh.vertices *= part.size if part.kind == "ellipsoid" else part.size[0]
    vertices = np.asarray(mesh.vertices)
    turned = rot.rotate(np.broadcast_to(part.quat, (len(vertices), 4)), vertices) + part.pos
    return turned, np.asarray(mesh.faces)


def _thinned(vertices: ndarray, faces: ndarray) -> tuple[ndarray, ndarray]:
    if len(faces) <= _FACES:
        return vertices, faces
    import trimesh

    cure = "pip install 'dance-retarget[view]'"
    missing = RobotError("meshes", found="no package fast_simplification", expected="it installed", cure=cure)
    import_or_refuse("fast_simplification", missing)
    mesh = trimesh.Trimesh(vertices, faces).simplify_quadric_decimation(face_count=_FACES)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)
