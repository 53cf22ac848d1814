"""A robot's physics as plain MJCF, for an engine in the browser that is a release behind: bodies, joints, servos, soles, floor.

It is written from the compiled model, so that nothing has to be resolved again: every number stands where it counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.typing import ArrayLike

from tracking.engines import floor_geoms

if TYPE_CHECKING:
    import mujoco

_INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")


def model_xml(model: mujoco.MjModel, kp: Float[ndarray, "J"], kd: Float[ndarray, "J"]) -> str:
    """MJCF of a model for training: one free root, hinges and slides, spheres that meet a floor, position servos.

    Args:
        model: as `training_model` makes it.
        kp: stiffness of the servos, one a joint [N m/rad].
        kd: their damping [N m s/rad].
    """
    root = Element("mujoco", model="robot")
    SubElement(root, "compiler", angle="radian", autolimits="false", balanceinertia="false")
    opt = model.opt
    SubElement(
        root, "option", timestep=_text(opt.timestep), gravity=_text(opt.gravity), integrator=_INTEGRATORS[int(opt.integrator)],
        iterations=str(opt.iterations), ls_iterations=str(opt.ls_iterations), cone=("pyramidal", "elliptic")[int(opt.cone)],
        impratio=_text(opt.impratio), tolerance=_text(opt.tolerance),
    )  # fmt: skip
    world = SubElement(root, "worldbody")
    floor = model.geom("floor").id
    SubElement(world, "geom", _touch(model, floor), name="floor", type="plane", size="0 0 0.05")
    elements, meets = {0: world}, floor_geoms(model)
    for body in range(1, model.nbody):
        place = {"pos": _text(model.body_pos[body]), "quat": _text(model.body_quat[body])}
        node = SubElement(elements[int(model.body_parentid[body])], "body", place, name=model.body(body).name)
        elements[body] = node
        SubElement(
            node, "inertial", pos=_text(model.body_ipos[body]), quat=_text(model.body_iquat[body]),
            mass=_text(model.body_mass[body]), diaginertia=_text(model.body_inertia[body]),
        )  # fmt: skip
        for joint in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]):
            _joint(node, model, joint)
        for geom in meets:
            if model.geom_bodyid[geom] == body:
                _sole(node, model, geom)
    servos = SubElement(root, "actuator")
    for k in range(model.nu):
        name = model.joint(int(model.actuator_trnid[k, 0])).name
        SubElement(
            servos, "general", name=name, joint=name, gaintype="fixed", biastype="affine", forcelimited="true",
            gainprm=_text([kp[k]]), biasprm=_text([0.0, -kp[k], -kd[k]]), forcerange=_text(model.actuator_forcerange[k]),
        )  # fmt: skip
    indent(root)
    return tostring(root, encoding="unicode")


def _joint(node: Element, model: mujoco.MjModel, joint: int) -> None:
    import mujoco

    kind, name = model.jnt_type[joint], model.joint(joint).name
    if kind == mujoco.mjtJoint.mjJNT_FREE:
        SubElement(node, "freejoint", name=name)
        return
    dof = model.jnt_dofadr[joint]
    SubElement(
        node, "joint", name=name, type="hinge" if kind == mujoco.mjtJoint.mjJNT_HINGE else "slide",
        pos=_text(model.jnt_pos[joint]), axis=_text(model.jnt_axis[joint]), range=_text(model.jnt_range[joint]),
        limited="true" if model.jnt_limited[joint] else "false", armature=_text(model.dof_armature[dof]),
        damping=_text(model.dof_damping[dof]), frictionloss=_text(model.dof_frictionloss[dof]),
        solreflimit=_text(model.jnt_solref[joint]), solimplimit=_text(model.jnt_solimp[joint]),
        actuatorfrclimited="true" if model.jnt_actfrclimited[joint] else "false",
        actuatorfrcrange=_text(model.jnt_actfrcrange[joint]),
    )  # fmt: skip


def _sole(node: Element, model: mujoco.MjModel, geom: int) -> None:
    import mujoco

    kind = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
    SubElement(
        node, "geom", _touch(model, geom), name=model.geom(geom).name, type=kind, mass="0", size=_text(model.geom_size[geom]),
        pos=_text(model.geom_pos[geom]), quat=_text(model.geom_quat[geom]),
    )  # fmt: skip


def _touch(model: mujoco.MjModel, geom: int) -> dict[str, str]:
    """What a geom is where it meets another."""
    return {
        "contype": str(model.geom_contype[geom]), "conaffinity": str(model.geom_conaffinity[geom]),
        "condim": str(model.geom_condim[geom]), "priority": str(model.geom_priority[geom]),
        "friction": _text(model.geom_friction[geom]), "solref": _text(model.geom_solref[geom]),
        "solimp": _text(model.geom_solimp[geom]), "margin": _text(model.geom_margin[geom]),
    }  # fmt: skip


def _text(values: ArrayLike) -> str:
    """Numbers at full precision."""
    return " ".join(repr(float(v)) for v in np.atleast_1d(values))
