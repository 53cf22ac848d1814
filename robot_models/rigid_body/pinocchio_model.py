"""The same robot for Pinocchio and placo, derived from the compiled arrays rather than read a second time.

Two readers of one file agree on numbers but not on joint order, limits or fixed links; one model handed on does.
Frame traps: Pinocchio stores quaternions xyzw and has both free-flyer velocities in the body frame; MuJoCo stores
wxyz, has the linear one in the world frame and the angular one in the body frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.errors import RobotError, import_or_refuse
from robot_models.maths import rotation as rot
from robot_models.model import RobotModel


def _pinocchio() -> Any:
    cure = "pip install pin==3.8.0 (no Windows wheels)"
    return import_or_refuse(
        "pinocchio", RobotError("Pinocchio", found="not installed", expected="pin 3.8.0", cure=cure)
    )


def pinocchio_model(robot: RobotModel) -> Any:
    """A `pinocchio.Model` with the joint order, inertias, armature and limits of `robot`.

    Raises:
        RobotError: Pinocchio is not installed.
    """
    pin, m = _pinocchio(), robot.model
    model = pin.Model()
    model.name = robot.name
    joint_of = {0: 0}  # MuJoCo body -> Pinocchio joint that carries it
    frame_of = {0: pin.SE3.Identity()}  # MuJoCo body -> pose of its origin in that joint's frame
    for body in range(1, m.nbody):
        parent = int(m.body_parentid[body])
        base = frame_of[parent] * _se3(pin, m.body_pos[body], m.body_quat[body])
        name = m.body(body).name
        if body == robot.body_ids[0]:
            joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
            place = pin.SE3.Identity()
        elif m.body_jntnum[body]:
            hinge = int(m.body_jntadr[body])
            i = robot.joint_names.index(m.joint(hinge).name)
            anchor = pin.SE3(np.eye(3), m.jnt_pos[hinge])
            joint = model.addJoint(
                joint_of[parent], pin.JointModelRevoluteUnaligned(m.jnt_axis[hinge]), base * anchor,
                robot.joint_names[i], robot.effort[[i]], robot.velocity[[i]], robot.lower[[i]], robot.upper[[i]],
            )  # fmt: skip
            place = anchor.inverse()
        else:
            joint, place = joint_of[parent], base
        model.appendBodyToJoint(joint, _inertia(pin, m, body), place)
        model.addFrame(pin.Frame(name, joint, 0, place, pin.FrameType.BODY))
        joint_of[body], frame_of[body] = joint, place
    armature = np.zeros(model.nv)
    armature[6:] = m.dof_armature[6:]
    model.armature = armature
    return model


def pinocchio_q(qpos: Float[ndarray, "... nq"]) -> Float[ndarray, "... nq"]:
    """Pinocchio's configuration (xyzw) of MuJoCo's qpos (wxyz)."""
    q = np.array(qpos, dtype=float)
    q[..., 3:7] = rot.to_quat_xyzw(qpos[..., 3:7])
    return q


def pinocchio_v(qpos: Float[ndarray, "... nq"], qvel: Float[ndarray, "... nv"]) -> Float[ndarray, "... nv"]:
    """Pinocchio's velocity (linear part in the body frame) of MuJoCo's qvel (linear part in the world frame)."""
    v = np.array(qvel, dtype=float)
    v[..., :3] = rot.rotate(rot.conjugate(qpos[..., 3:7]), qvel[..., :3])
    return v


def urdf_text(robot: RobotModel) -> str:
    """Mesh-free URDF of the robot with full-precision numbers, for placo and for a second physics engine."""
    m = robot.model
    lines = [f'<?xml version="1.0"?><robot name="{robot.name}">']
    for body in range(1, m.nbody):
        r, d = rot.to_matrix(m.body_iquat[body]), m.body_inertia[body]
        i = r @ np.diag(d) @ r.T
        lines.append(
            f'<link name="{urdf_link(robot, m.body(body).name)}"><inertial><origin xyz="{_text(m.body_ipos[body])}" rpy="0 0 0"/>'
            f'<mass value="{float(m.body_mass[body])!r}"/><inertia ixx="{float(i[0, 0])!r}" ixy="{float(i[0, 1])!r}" '
            f'ixz="{float(i[0, 2])!r}" iyy="{float(i[1, 1])!r}" iyz="{float(i[1, 2])!r}" izz="{float(i[2, 2])!r}"/>'
            f"</inertial></link>"
        )
    for body in range(2, m.nbody):
        lines.append(_urdf_joint(robot, body))
    return "\n".join([*lines, "</robot>"])


def urdf_link(robot: RobotModel, body: str) -> str:
    """A body's link in `urdf_text`: one that is called as a joint gets another name, for placo keeps one list of both."""
    return f"{body}_link" if body in robot.joint_names else body


def _urdf_joint(robot: RobotModel, body: int) -> str:
    m = robot.model
    name, parent = (urdf_link(robot, m.body(b).name) for b in (body, int(m.body_parentid[body])))
    origin = f'<origin xyz="{_text(m.body_pos[body])}" rpy="{_text(_rpy(m.body_quat[body]))}"/>'
    links = f'<parent link="{parent}"/><child link="{name}"/>'
    if not m.body_jntnum[body]:
        return f'<joint name="{name}_fixed" type="fixed">{origin}{links}</joint>'
    hinge = int(m.body_jntadr[body])
    if np.any(m.jnt_pos[hinge] != 0.0):
        raise RobotError(
            f"robot '{robot.name}', joint '{m.joint(hinge).name}'",
            found="an axis that does not pass through its body's origin",
            expected="the origin on the axis: URDF can say nothing else",
        )
    i = robot.joint_names.index(m.joint(hinge).name)
    lower, upper = float(robot.lower[i]), float(robot.upper[i])
    return (
        f'<joint name="{robot.joint_names[i]}" type="revolute">{origin}{links}<axis xyz="{_text(m.jnt_axis[hinge])}"/>'
        f'<limit lower="{lower!r}" upper="{upper!r}" effort="{float(robot.effort[i])!r}" '
        f'velocity="{float(robot.velocity[i])!r}"/></joint>'
    )


def _text(v: ndarray) -> str:
    return " ".join(repr(float(x)) for x in v)


def _rpy(quat: ndarray) -> ndarray:
    """Roll, pitch, yaw of URDF: extrinsic x, y, z."""
    r = rot.to_matrix(quat)
    return np.array(
        [np.arctan2(r[2, 1], r[2, 2]), np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0])), np.arctan2(r[1, 0], r[0, 0])]
    )


def _se3(pin: Any, pos: ndarray, quat: ndarray) -> Any:
    return pin.SE3(rot.to_matrix(quat), np.array(pos))


def _inertia(pin: Any, m: Any, body: int) -> Any:
    r = rot.to_matrix(m.body_iquat[body])
    return pin.Inertia(float(m.body_mass[body]), np.array(m.body_ipos[body]), r @ np.diag(m.body_inertia[body]) @ r.T)
