"""What a robot looks like: its own primitives, or the real meshes where a package brings them."""

from __future__ import annotations

import importlib
import os
import sys
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models.geometry import body_geoms
from robot_models.incoming import turned, turns_of
from robot_models.maths import rotation as rot
from robot_models.model import RobotModel
from robot_models.model_file import locate, open_spec
from robot_models.profile import RobotProfile

_MESHES = (".stl", ".dae", ".obj", ".ply", ".glb", ".gltf")
_UPWARDS = 5  # folders above a URDF in which its package may begin


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """One piece of a body's surface, in the body's frame."""

    body: str
    kind: str  # "box", "capsule", "cylinder", "sphere", "ellipsoid" or "mesh"
    pos: Float[ndarray, "3"]  # [m]
    quat: Float[ndarray, "4"]  # wxyz
    size: Float[ndarray, "3"]  # box: half sizes; capsule, cylinder: radius, half length; sphere: radius [m]
    rgba: tuple[float, float, float, float]
    vertices: Float[ndarray, "V 3"] | None = None  # [m]
    faces: Int[ndarray, "F 3"] | None = None


def has_display() -> bool:
    """Whether a window can be opened here."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def draw_off_screen() -> None:
    """Have MuJoCo draw without a display where there is none, whoever imported it before.

    MuJoCo chooses its OpenGL by MUJOCO_GL when it is imported, and a window's unless told otherwise.
    """
    if os.environ.get("MUJOCO_GL") or has_display():
        return
    os.environ["MUJOCO_GL"] = "egl"
    importlib.reload(importlib.import_module("mujoco.rendering.classic.gl_context"))


def visual_parts(robot: RobotModel) -> list[Part]:
    """The robot's meshes where they are installed or its model file has them; primitives of every body without."""
    source = robot.profile.meshes or robot.profile.source
    path = locate(source, robot.profile.folder)
    parts = (
        []
        if path is None
        else (mesh_parts if path.suffix.lower() == ".urdf" else mjcf_mesh_parts)(robot.body_names, path)
    )
    parts = _upright(parts, robot.profile, path)
    drawn = {part.body for part in parts}
    return parts + [part for part in primitive_parts(robot) if not parts or part.body not in drawn]


def _upright(parts: list[Part], profile: RobotProfile, path: Path | None) -> list[Part]:
    """Meshes of bodies whose frames the profile turns, in these frames."""
    if not profile.source.upright or path is None:
        return parts
    source = profile.source
    turns = turns_of(open_spec(path, repair=source.inertia == "repair").compile(), source.upright, source.yaw)
    return [
        part if part.vertices is None else replace(part, vertices=turned({part.body: part.vertices}, turns)[part.body])
        for part in parts
    ]


def primitive_parts(robot: RobotModel) -> list[Part]:
    """The primitives of the compiled model."""
    import mujoco

    m, names = robot.model, dict(zip(robot.body_ids, robot.body_names, strict=True))
    kinds = {
        mujoco.mjtGeom.mjGEOM_BOX: "box",
        mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
        mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
        mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    }
    return [
        Part(
            body=names[int(m.geom_bodyid[g])],
            kind=kinds[mujoco.mjtGeom(int(m.geom_type[g]))],
            pos=np.array(m.geom_pos[g]),
            quat=np.array(m.geom_quat[g]),
            size=np.array(m.geom_size[g]),
            rgba=_rgba(m.geom_rgba[g]),
        )
        for g in body_geoms(robot)
        if int(m.geom_bodyid[g]) in names
    ]


def _rgba(colour: ndarray) -> tuple[float, float, float, float]:
    r, g, b, a = (float(c) for c in colour)
    return r, g, b, a


def mesh_parts(bodies: Sequence[str], urdf: Path) -> list[Part]:
    """The visual meshes of a URDF, carried over to its moving bodies (fixed links merged into their parents)."""
    import trimesh

    tree = ET.parse(urdf).getroot()
    carrier = _carriers(tree, set(bodies))
    parts = []
    for link in tree.findall("link"):
        body, body_from_link = carrier.get(link.get("name", ""), ("", np.eye(4)))
        for visual in link.findall("visual") if body else []:
            mesh = visual.find("geometry/mesh")
            path = _mesh_path(mesh.get("filename", ""), urdf) if mesh is not None else None
            if mesh is None or path is None:
                continue
            shape = trimesh.load(path, force="mesh")
            scale = np.array([float(s) for s in mesh.get("scale", "1 1 1").split()])
            body_from_mesh = body_from_link @ _origin(visual)
            points = np.asarray(shape.vertices, dtype=float) * scale
            # A mirroring scale turns the faces inside out.
            faces = np.asarray(shape.faces, dtype=int)[:, :: -1 if scale.prod() < 0 else 1]
            vertices = points @ body_from_mesh[:3, :3].T + body_from_mesh[:3, 3]
            parts.append(_as_part(body, (0.75, 0.77, 0.8, 1.0), vertices, faces))
    return parts


def mjcf_mesh_parts(bodies: Sequence[str], path: Path) -> list[Part]:
    """The meshes of an MJCF, carried over to the moving bodies; [] where it has none or MuJoCo cannot find them.

    Where a body has meshes that touch nothing, which is how models mark what is to be seen, these alone are taken.
    """
    import mujoco

    if "<mesh" not in path.read_text(errors="replace"):
        return []
    try:
        m = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return []
    meshes = [g for g in range(m.ngeom) if m.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH and m.geom_bodyid[g]]
    seen = [g for g in meshes if not m.geom_contype[g] and not m.geom_conaffinity[g]]
    shown = {int(m.geom_bodyid[g]) for g in seen}
    found = []
    for g in seen + [g for g in meshes if int(m.geom_bodyid[g]) not in shown]:
        at, mesh = int(m.geom_bodyid[g]), int(m.geom_dataid[g])
        first, face = int(m.mesh_vertadr[mesh]), int(m.mesh_faceadr[mesh])
        points = np.array(m.mesh_vert[first : first + int(m.mesh_vertnum[mesh])], dtype=float)
        points = m.geom_pos[g] + rot.rotate(np.broadcast_to(m.geom_quat[g], (len(points), 4)), points)
        while m.body(at).name not in bodies and at:  # welded, or frozen at zero
            points = m.body_pos[at] + rot.rotate(np.broadcast_to(m.body_quat[at], (len(points), 4)), points)
            at = int(m.body_parentid[at])
        if at:
            material = int(m.geom_matid[g])
            colour = _rgba(m.mat_rgba[material] if material >= 0 else m.geom_rgba[g])
            faces = np.array(m.mesh_face[face : face + int(m.mesh_facenum[mesh])], dtype=int)
            found.append(_as_part(m.body(at).name, colour, points, faces))
    return found


def _as_part(body: str, rgba: tuple[float, float, float, float], vertices: ndarray, faces: ndarray) -> Part:
    """Triangles in a body's frame."""
    return Part(
        body=body, kind="mesh", pos=np.zeros(3), quat=rot.IDENTITY, size=np.zeros(3), rgba=rgba,
        vertices=vertices, faces=faces,
    )  # fmt: skip


def _carriers(tree: ET.Element, bodies: set[str]) -> dict[str, tuple[str, ndarray]]:
    """Link -> (moving body that carries it, body_from_link), walking down fixed joints."""
    found = {b: (b, np.eye(4)) for b in bodies}
    joints = tree.findall("joint")
    for _ in joints:
        for joint in joints:
            parent, child = (_require(joint, tag).get("link", "") for tag in ("parent", "child"))
            if parent in found and child not in found:
                body, pose = found[parent]
                found[child] = (body, pose @ _origin(joint))
    return found


def _require(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    return found if found is not None else ET.Element(tag)


def _origin(element: ET.Element) -> ndarray:
    """4 x 4 transform of a URDF <origin>: extrinsic roll, pitch, yaw."""
    origin = _require(element, "origin")
    roll, pitch, yaw = (float(v) for v in origin.get("rpy", "0 0 0").split())
    pose = np.eye(4)
    pose[:3, :3] = rot.to_matrix(rot.from_euler(np.array([yaw, pitch, roll]), "ZYX"))
    pose[:3, 3] = [float(v) for v in origin.get("xyz", "0 0 0").split()]
    return pose


def _mesh_path(name: str, urdf: Path) -> Path | None:
    """A mesh beside its URDF: `package://robots/x/y.stl` is looked up along the URDF's nearest parents, never outside."""
    relative = Path(name.removeprefix("package://").lstrip("/") if name.startswith("package://") else name)
    if relative.is_absolute() or relative.suffix.lower() not in _MESHES:
        return None
    near = [folder.resolve() for folder in list(urdf.resolve().parents)[:_UPWARDS]]
    for folder in near:
        for tail in (relative, Path(*relative.parts[1:])):
            path = (folder / tail).resolve()
            if path.is_file() and path.is_relative_to(near[-1]):
                return path
    return None
