"""Bodies with several joints as chains of bodies with one: SMPL's 23 have three each, and every body here has a joint of its own.

MuJoCo turns a body by its joints one after another, each about an axis that those before have turned: that is what a chain
of bodies without mass does. The body keeps its name at the end of the chain.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mujoco

_PLACE = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "childclass")
_TINY = {"pos": "0 0 0", "mass": "1e-6", "diaginertia": "1e-9 1e-9 1e-9"}


def split_joints(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The same robot with one joint a body; the spec itself where it is so already.

    Raises:
        ValueError: MuJoCo refuses it.
    """
    import mujoco

    if all(len(body.joints) < 2 for body in spec.bodies[1:]):
        return spec
    spec.compile()
    tree = ET.fromstring(spec.to_xml())
    compiler = tree.find("compiler")
    if compiler is not None:
        compiler.set("inertiafromgeom", "auto")  # a chain's links have no geoms
    names = {body.get("name", "") for body in tree.iter("body")}
    for parent in [*tree.iter("worldbody"), *tree.iter("body")]:
        for body in parent.findall("body"):
            _split(parent, body, names)
    return mujoco.MjSpec.from_string(ET.tostring(tree, encoding="unicode"))


def _split(parent: ET.Element, body: ET.Element, names: set[str]) -> None:
    """Put a chain between a body and its parent, where it has several joints."""
    joints = body.findall("joint")
    if len(joints) < 2:
        return
    place = {key: body.attrib.pop(key) for key in _PLACE if key in body.attrib}
    where = list(parent).index(body)
    parent.remove(body)
    above, at = parent, where
    for joint in joints[:-1]:
        link = ET.Element("body", {"name": _name(joint.get("name", "joint"), names), **place})
        link.append(ET.Element("inertial", _TINY))
        body.remove(joint)
        link.append(joint)
        above.insert(at, link)
        above, at, place = link, len(link), {}
    above.append(body)


def _name(wanted: str, taken: set[str]) -> str:
    """A name that no body has."""
    name = wanted
    while name in taken:
        name += "_link"
    taken.add(name)
    return name
