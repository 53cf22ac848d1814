"""From a robot's model file (URDF or MJCF, ours or an installed package's) to a mesh-free `mujoco.MjSpec`."""

from __future__ import annotations

import importlib.util
import re
import sys
import sysconfig
import xml.etree.ElementTree as ET
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robot_models.errors import RobotError
from robot_models.incoming import (
    MAX_BODIES,
    MAX_ELEMENTS,
    MAX_MODEL,
    Linkage,
    make_serial,
    printable,
    read_text,
    refusal_of_child,
    split_joints,
    turn_upright,
)
from robot_models.profile import RobotProfile, Source

if TYPE_CHECKING:
    import mujoco

# Packages built with cmeel keep their data here, beside site-packages rather than in an importable module.
_CMEEL = Path("cmeel.prefix/share")


def locate(source: Source, folder: Path) -> Path | None:
    """Path of the model file, or None where the package that holds it is not installed."""
    if not source.package:
        return folder / source.path
    roots = [Path(p) / _CMEEL / source.package for p in {sysconfig.get_paths()["purelib"], *sys.path} if p]
    found = importlib.util.find_spec(source.package) if source.package.isidentifier() else None
    if found is not None and found.submodule_search_locations:
        roots += [Path(p) for p in found.submodule_search_locations]
    return next((r / source.path for r in roots if (r / source.path).is_file()), None)


def read_spec(profile: RobotProfile) -> mujoco.MjSpec:
    """The robot's tree without meshes, its root free and named `root`.

    Raises:
        RobotError: the file is absent or MuJoCo refuses it.
    """
    path = locate(profile.source, profile.folder)
    if path is None or not path.is_file():
        raise RobotError(
            f"robot '{profile.name}'",
            found=f"no model file {profile.source.path}",
            expected=f"the package {profile.source.package}" if profile.source.package else f"the file {path}",
            cure=profile.source.install,
        )
    # The profile's capsules stand for the whole surface where there are any.
    source = profile.source
    spec = open_spec(
        path, primitives=not profile.capsules, repair=source.inertia == "repair", upright=source.upright, yaw=source.yaw,
    )  # fmt: skip
    root = spec.worldbody.first_body()
    if root.name != profile.root:
        raise RobotError(
            f"robot '{profile.name}', root", found=f"'{root.name}' at the top of the tree",
            expected=f"'{profile.root}' (bodies: {', '.join(b.name for b in spec.bodies[1:])})",
        )  # fmt: skip
    _freeze(spec, profile)
    return spec


def _text_of(path: Path) -> str:
    text = read_text(path, expected="a URDF or MJCF robot", most=MAX_MODEL, error=RobotError)
    if "<!ENTITY" in text:
        raise RobotError(str(path), found="XML entities", expected="a robot spelt out", cure="expand them first")
    return text


def open_spec(
    path: Path, *, primitives: bool = True, repair: bool = False, upright: Collection[str] = (), yaw: float = 0.0
) -> mujoco.MjSpec:
    """A model file's tree without meshes and scenery, its root free and named `root`, one joint a body.

    Args:
        path: a URDF or an MJCF.
        primitives: keep the URDF's own boxes, spheres and cylinders.
        repair: mend massless links and impossible inertias.
        upright: bodies whose frames are turned to the world's at zero.
        yaw: by how much the robot is turned for that, to face +x [rad].

    Raises:
        RobotError: XML that is broken or has entities, or no body in it.
    """
    import mujoco

    text = _text_of(path)
    try:
        tree = ET.fromstring(text)
        _refuse_xacro(path, tree)
        _try_in_child(path, tree)
        if tree.tag == "robot":
            spec = mujoco.MjSpec.from_string(_urdf_for_mujoco(text, primitives, repair))
        else:
            spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, RuntimeError, ET.ParseError) as e:
        raise RobotError(str(path), found=f"a file that MuJoCo refuses ({e})", expected="a URDF or MJCF robot") from e
    if len(spec.bodies) > MAX_BODIES:
        raise RobotError(str(path), found=f"{len(spec.bodies)} bodies", expected=f"a robot of at most {MAX_BODIES}")
    _strip(spec)
    make_serial(spec)
    _free_the_root(spec, path)
    try:
        return turn_upright(split_joints(spec), upright, yaw)
    except (ValueError, RuntimeError, KeyError) as e:
        raise RobotError(str(path), found=f"a file that MuJoCo refuses ({e})", expected="a URDF or MJCF robot") from e


def _refuse_xacro(path: Path, tree: ET.Element) -> None:
    if any("xacro" in element.tag for element in tree.iter()) or path.suffix == ".xacro":
        raise RobotError(
            str(path), found="xacro, from which a URDF is made", expected="a URDF or MJCF robot",
            cure=f"expand it first: xacro {path.name} > {path.name.partition('.')[0]}.urdf",
        )  # fmt: skip


def linkages(path: Path) -> Linkage:
    """What ties joints of a model file to one another: rods, gears and belts, which a robot here has none of.

    Mimicking joints and tendons are told as left, too.

    Raises:
        RobotError: as `open_spec`.
    """
    import mujoco

    tree = ET.fromstring(_text_of(path))
    if tree.tag == "robot":
        joints = [j for j in tree.iter("joint") if j.find("mimic") is not None]
        told = [f"{j.get('name', '')} mimics {j.find('mimic').get('joint', '')}" for j in joints]  # type: ignore[union-attr]
        return Linkage(driven={}, pairs=(), left=tuple(told))
    spec = mujoco.MjSpec.from_file(str(path))
    _strip(spec)
    linkage = make_serial(spec)
    return replace(linkage, left=(*linkage.left, *(tendon.name or "a tendon" for tendon in spec.tendons)))


_NO_NUMBER = re.compile(r"(?:^|\s)[-+]?(?:nan|inf|infinity)(?:\s|$)", re.IGNORECASE)
_GROWING = {
    "include",
    "attach",
    "model",
    "replicate",
    "composite",
    "flexcomp",
    "flex",
    "hfield",
    "texture",
    "plugin",
    "skin",
}
_TRY = """
import mujoco
mujoco.MjSpec.from_file(sys.argv[1])
"""


def _try_in_child(path: Path, tree: ET.Element) -> None:
    """Have a process of limited time and memory open a file that may grow beyond what stands in it.

    Raises:
        RobotError: it came to grief, or has more elements than any robot.
    """
    for element in tree.iter():
        for key, value in element.attrib.items():
            urdf_mesh = tree.tag == "robot" and element.tag == "mesh"  # left out before MuJoCo sees it
            if (
                "%" in value and not urdf_mesh
            ):  # MuJoCo 4.0 prints what it complains of as a format: %n ends the process, %s reads its memory
                raise RobotError(
                    f"{path}, {element.tag} {key}", found=printable(value[:60]), expected="no per cent sign"
                )
            if key != "name" and _NO_NUMBER.search(value):
                raise RobotError(f"{path}, {element.tag} {key}", found=value[:60], expected="finite numbers")
    tags = [element.tag for element in tree.iter()]
    bodies = tags.count("link")
    if len(tags) > MAX_ELEMENTS or bodies > MAX_BODIES:
        raise RobotError(
            str(path),
            found=f"{len(tags)} elements, {bodies} links",
            expected=f"at most {MAX_ELEMENTS} and {MAX_BODIES}",
        )
    if tree.tag != "robot" and _GROWING & set(tags):
        complaint = refusal_of_child(_TRY, [str(path)])
        if complaint:
            raise RobotError(
                str(path), found=f"a file that MuJoCo comes to grief over ({complaint})", expected="a robot"
            )


def _urdf_for_mujoco(text: str, primitives: bool, repair: bool) -> str:
    """URDF text with its meshes dropped and MuJoCo's compiler told to merge fixed links and keep inertias."""
    robot = ET.fromstring(text)
    for link in robot.iter("link"):
        for part in [e for e in link if e.tag in ("visual", "collision")]:
            if part.tag == "visual" or not primitives or part.find("geometry/mesh") is not None:
                link.remove(part)
    for element in robot.findall("mujoco"):
        robot.remove(element)
    options = {"discardvisual": "true", "fusestatic": "true"}
    if repair:
        options |= {"boundmass": "1e-6", "boundinertia": "1e-9", "balanceinertia": "true"}
    extension = ET.SubElement(robot, "mujoco")
    ET.SubElement(extension, "compiler", options)
    return ET.tostring(robot, encoding="unicode")


def _strip(spec: mujoco.MjSpec) -> None:
    """Leave the robot alone: no meshes, no scenery, no sensors or key frames of another use."""
    import mujoco

    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH or geom.parent == spec.worldbody:
            spec.delete(geom)
    for things in (
        spec.meshes, spec.textures, spec.hfields, spec.sensors, spec.keys, spec.pairs
    ):  # fmt: skip
        for thing in list(things):
            spec.delete(thing)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)


def _free_the_root(spec: mujoco.MjSpec, path: Path) -> None:
    root = spec.worldbody.first_body()
    if root is None:
        raise RobotError(str(path), found="no body", expected="a robot")
    free = [j for j in root.joints if _is_free(j)]
    if free:
        free[0].name = "root"
    else:
        _cut_loose(spec, root)
        root.add_freejoint(name="root")
    root.pos = [0.0, 0.0, 0.0]


def _freeze(spec: mujoco.MjSpec, profile: RobotProfile) -> None:
    for pattern in profile.freeze:
        hits = [j for j in spec.joints if re.fullmatch(pattern, j.name)]
        if not hits:
            raise RobotError(
                f"robot '{profile.name}', freeze pattern '{pattern}'",
                found="no such joint",
                expected=f"a full match among {', '.join(j.name for j in spec.joints)}",
            )
        for joint in hits:
            spec.delete(joint)


def _cut_loose(spec: mujoco.MjSpec, root: mujoco.MjsBody) -> None:
    """Drop slides and hinges between world and root, which stand for a free joint, and the motors on them."""
    names = {joint.name for joint in root.joints}
    for actuator in [a for a in spec.actuators if a.target in names]:
        spec.delete(actuator)
    for joint in list(root.joints):
        spec.delete(joint)


def _is_free(joint: mujoco.MjsJoint) -> bool:
    import mujoco

    return bool(joint.type == mujoco.mjtJoint.mjJNT_FREE)
