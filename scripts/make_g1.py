"""Write a mesh-free MJCF of the Unitree G1 from the URDF that ships in example-robot-data.

Kinematic tree, joint ranges, masses and inertias are copied from `g1_29dof_rev_1_0.urdf` (BSD-3-Clause); links behind fixed
joints are merged into the body that carries them. The meshes are replaced by the primitives of the table below, fitted to them.
Usage: `python make_g1.py g1.xml`.
"""

import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

ROBOTS = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots"
URDF = ROBOTS / "g1_description/urdf/g1_29dof_rev_1_0.urdf"
NOTE = """
  Unitree G1, 29 joints: kinematic tree, joint ranges, masses and inertias of g1_29dof_rev_1_0.urdf
  (unitree_ros by Unitree Robotics, BSD-3-Clause; copy in example-robot-data 6.0.0), fixed links merged into
  their parents. Collision primitives fitted to the meshes. Written by make_g1.py: edit that, not this file.
"""
# Links that only mark a sensor, and the name of the site they become.
SENSOR_SITES = {"imu_in_pelvis": "imu", "imu_in_torso": "imu_torso"}
# Centre of the head mesh's bounding box in the torso frame [m].
HEAD_CENTRE = (0.008, 0.0, 0.384)
# Millimetres, body frame: capsule = end, end, radius; sphere = centre, radius; box = centre, half sizes and, in radians, rpy.
# Right bodies are the mirror images of the left ones.
PRIMITIVES = {
    "pelvis": ("box 0 0 -75  46 61 43  0 0 0", "capsule 1 -10 -93  1 10 -93  59", "sphere 1 0 -54  59"),
    "left_hip_pitch_link": ("capsule -2 29 -3  -2 64 -20  34.5", "capsule 1 37 -40  1 62 -41  37"),
    "left_hip_roll_link": (
        "capsule 52 -18 10  54 -23 -103  22",
        "capsule 52 18 10  54 23 -103  22",
        "capsule 12 -15 -94  12 15 -94  32",
    ),
    "left_hip_yaw_link": (
        "capsule 9 0 -36  -16 0 -39  41",
        "capsule -3 1 -82  -60 -7 -181  36",
        "capsule -84 -12 -191  -89 -10 -166  35",
    ),
    "left_knee_link": (
        "capsule -2 0 -58  0 0 -154  35",
        "capsule 0 19 11  9 -1 -294  20",
        "capsule 20 0 -184  37 5 -23  29",
    ),
    "left_ankle_pitch_link": ("box -4 0 -8  13 5.5 15  0 0.17 0",),
    # Above the sole: its lowest point is 9 mm over the sole plane, and it stays within the sole's length.
    "left_ankle_roll_link": ("box 33 0 -9  83 27 9  0 0.1 0",),
    "waist_yaw_link": ("box 2 0 18  31 31 15  0 0 0",),
    "waist_roll_link": ("capsule -5 0 0  5 0 0  11",),
    "torso_link": ("capsule 5 21 66  3 38 232  69", "capsule 5 -21 66  3 -38 232  69", "capsule 3 0 345  9 0 421  64"),
    "left_shoulder_pitch_link": ("capsule 0 28 1  0 40 -17  34",),
    "left_shoulder_roll_link": ("capsule 0 2 -1  0 7 -64  36",),
    "left_shoulder_yaw_link": ("capsule -1 0 3  -3 0 -45  32", "capsule 4 -8 -64  16 -8 -82  33"),
    "left_elbow_link": ("capsule 7 19 13  -6 21 -6  14", "capsule 45 6 -10  72 1 -10  32"),
    "left_wrist_roll_link": ("capsule 22 -8 0  22 8 0  26",),
    "left_wrist_pitch_link": ("capsule -2 0 0  48 0 0  27",),
    "left_wrist_yaw_link": (
        "capsule 8 1 0  31 2 0  26",
        "box 114 -6 0  50 10 33  0 0.09 -0.29",
        "capsule 84 4 35  122 -16 55  8",
    ),
}
DARK = ("left_hip_pitch_link", "left_ankle_roll_link", "waist_yaw_link", "torso_link_3", "left_wrist_roll_link")
# Neighbours but not parent and child: their primitives overlap by construction (see check_g1.py).
EXCLUDES = (
    ("left_knee_link", "left_ankle_roll_link"),
    ("right_knee_link", "right_ankle_roll_link"),
    ("waist_yaw_link", "torso_link"),
    ("torso_link", "left_shoulder_roll_link"),
    ("torso_link", "right_shoulder_roll_link"),
)


@dataclass
class Inertia:
    """Mass, centre of mass and rotational inertia about it, in the body frame."""

    mass: float
    com: np.ndarray
    matrix: np.ndarray


def text(values) -> str:
    """Shortest decimals that read back as the same floats."""
    return " ".join(repr(float(v) + 0.0).removesuffix(".0") for v in np.atleast_1d(values))


def vector(element: ET.Element | None, key: str) -> np.ndarray:
    """URDF triple, zero where the element or the attribute is absent."""
    return np.array([float(v) for v in ("0 0 0" if element is None else element.get(key, "0 0 0")).split()])


def quat_from_rpy(rpy: np.ndarray) -> np.ndarray:
    """Quaternion wxyz of Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy / 2), np.sin(rpy / 2)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def read_inertia(link: ET.Element, offset: np.ndarray) -> Inertia:
    """Inertia of one link, whose frame stands at `offset` in the body and is parallel to it."""
    e = link.find("inertial")
    ixx, ixy, ixz, iyy, iyz, izz = (float(e.find("inertia").get(k)) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    assert not vector(e.find("origin"), "rpy").any()
    matrix = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    return Inertia(float(e.find("mass").get("value")), vector(e.find("origin"), "xyz") + offset, matrix)


def merge(parts: list[Inertia]) -> Inertia:
    """One rigid body from several, by the parallel-axis theorem."""
    if len(parts) == 1:
        return parts[0]
    mass = sum(p.mass for p in parts)
    com = sum(p.mass * p.com for p in parts) / mass
    arms = [p.com - com for p in parts]
    matrix = sum(p.matrix + p.mass * (a @ a * np.eye(3) - np.outer(a, a)) for p, a in zip(parts, arms, strict=True))
    return Inertia(mass, com, matrix)


def geom_attributes(primitive: str, right: bool) -> dict[str, str]:
    """MJCF attributes of one line of the table; on the right side reflected in the plane y = 0."""
    kind, *numbers = primitive.split()
    v, side = np.array(numbers, dtype=float), np.array([1, -1 if right else 1, 1])
    if kind == "capsule":
        ends = v[:6].reshape(2, 3) * side / 1000
        return {"type": kind, "size": text(v[6] / 1000), "fromto": text(ends.ravel())}
    out = {"type": kind, "size": text(v[3 : 6 if kind == "box" else 4] / 1000), "pos": text(v[:3] * side / 1000)}
    if kind == "box" and v[6:].any():
        out["quat"] = text(quat_from_rpy(v[6:] * (side * side[1])))  # A reflection in y turns roll and yaw around.
    return out


def add_geoms(body: ET.Element, name: str) -> None:
    """Append the primitives of body `name`, called <body>_1, <body>_2, ..."""
    left = name.replace("right_", "left_")
    for n, primitive in enumerate(PRIMITIVES[left], start=1):
        material = "dark" if left in DARK or f"{left}_{n}" in DARK else "light"
        attributes = {"name": f"{name}_{n}", "class": "collision", **geom_attributes(primitive, right=left != name)}
        ET.SubElement(body, "geom", {**attributes, "material": material})


def add_body(parent: ET.Element, urdf: ET.Element, name: str, joint: ET.Element | None) -> None:
    """Append the body of link `name` with all below it; fixed links add their inertia or their site."""
    body = ET.SubElement(parent, "body", {"name": name})
    if joint is None:
        ET.SubElement(body, "freejoint", {"name": "root"})
    else:
        origin, limit = joint.find("origin"), joint.find("limit")
        body.set("pos", text(vector(origin, "xyz")))
        if vector(origin, "rpy").any():
            body.set("quat", text(quat_from_rpy(vector(origin, "rpy"))))
        bounds = [float(limit.get("lower")), float(limit.get("upper"))]
        ET.SubElement(
            body,
            "joint",
            {"name": joint.get("name"), "axis": text(vector(joint.find("axis"), "xyz")), "range": text(bounds)},
        )
    children = [j for j in urdf.findall("joint") if j.find("parent").get("link") == name]
    parts, sites = [read_inertia(urdf.find(f"link[@name='{name}']"), np.zeros(3))], {}
    for fixed in (j for j in children if j.get("type") == "fixed"):
        link, origin = urdf.find(f"link[@name='{fixed.find('child').get('link')}']"), fixed.find("origin")
        if link.find("inertial") is not None:
            assert not vector(origin, "rpy").any()
            parts.append(read_inertia(link, vector(origin, "xyz")))
        elif link.get("name") in SENSOR_SITES:
            assert not vector(origin, "rpy").any()
            sites[SENSOR_SITES[link.get("name")]] = vector(origin, "xyz")
    total = merge(parts)
    ET.SubElement(
        body,
        "inertial",
        {
            "pos": text(total.com),
            "mass": text(total.mass),
            "fullinertia": text([*np.diag(total.matrix), total.matrix[0, 1], total.matrix[0, 2], total.matrix[1, 2]]),
        },
    )
    add_geoms(body, name)
    for site, pos in (sites | ({"head": HEAD_CENTRE} if name == "torso_link" else {})).items():
        ET.SubElement(body, "site", {"name": site, "pos": text(pos)})
    for moving in (j for j in children if j.get("type") != "fixed"):
        add_body(body, urdf, moving.find("child").get("link"), moving)


def make_mjcf(urdf: ET.Element) -> ET.Element:
    """The whole model."""
    mjcf = ET.Element("mujoco", {"model": "g1"})
    mjcf.append(ET.Comment(NOTE))
    ET.SubElement(mjcf, "compiler", {"angle": "radian", "autolimits": "true"})
    default = ET.SubElement(mjcf, "default")
    ET.SubElement(default, "site", {"size": "0.01", "group": "4"})
    collision = ET.SubElement(default, "default", {"class": "collision"})
    ET.SubElement(collision, "geom", {"group": "0", "contype": "1", "conaffinity": "1", "mass": "0"})
    asset = ET.SubElement(mjcf, "asset")
    ET.SubElement(asset, "material", {"name": "light", "rgba": "0.75 0.76 0.78 1"})
    ET.SubElement(asset, "material", {"name": "dark", "rgba": "0.22 0.23 0.25 1"})
    world = ET.SubElement(mjcf, "worldbody")
    add_body(world, urdf, "pelvis", None)
    adjacent = [(p.get("name"), c.get("name")) for p in world.iter("body") for c in p.findall("body")]
    contact = ET.SubElement(mjcf, "contact")
    for one, two in [*adjacent, *EXCLUDES]:
        ET.SubElement(contact, "exclude", {"body1": one, "body2": two})
    return mjcf


def main() -> None:
    """Write the file named on the command line."""
    mjcf = make_mjcf(ET.parse(URDF).getroot())
    ET.indent(mjcf)
    Path(sys.argv[1]).write_text(ET.tostring(mjcf, encoding="unicode") + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
