"""Whether a robot can do a motion at all: rigid-body dynamics of a reference, frame by frame.

Inverse dynamics (Pinocchio) says which contact wrench the motion needs. The points that touch give what their
friction cones allow, as little off that wrench as can be; what is missing would have to come from nowhere. A score
says how bad that is; `stretch` says where and why.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import Reference
from retarget.dynamics.contact_forces import Demand, contact_forces
from retarget.dynamics.floor_points import continuous_ranges, floor_points
from retarget.dynamics.support import outside_support
from retarget.errors import RetargetError
from retarget.rules import DynamicsConfig
from robot_models import RobotModel, pinocchio_model, pinocchio_q, pinocchio_v
from robot_models.maths import rotation as rot

_RULES = DynamicsConfig()


@dataclass(frozen=True, kw_only=True, eq=False)
class Dynamics:
    """What a motion asks of floor and motors. T frames, J joints, P floor points (soles first)."""

    fps: float
    joint_names: tuple[str, ...]
    weight: float  # [N]
    joint_torque: Float[ndarray, "T J"]  # with the contact forces below, armature included, friction not [N m]
    in_contact: Bool[ndarray, "T P"]  # points that may carry force
    point_w: Float[ndarray, "T P 3"]  # [m]
    force_w: Float[ndarray, "T P 3"]  # of the floor on the points [N]
    net_wrench_w: Float[ndarray, "T 6"]  # contact force [N] and moment about the CoM [N m] that the motion needs
    residual: Float[ndarray, "T 6"]  # the part of it that the points cannot give, same frame and units
    com_w: Float[ndarray, "T 3"]  # [m]
    zmp_w: Float[ndarray, "T 2"]  # on the floor [m]; NaN in flight and where less than 0.1 of the weight is carried
    zmp_outside: Float[ndarray, "T"]  # distance of the ZMP from the hull of the touching points [m]; 0 inside or NaN
    effort_share: Float[ndarray, "T"]  # largest `RobotModel.torque_share`
    worst_joint: tuple[str, ...]  # whose that is
    solve_error: Float[ndarray, "T"]  # of the contact forces' optimality, in gates; above 1e-6 they are not the best

    @property
    def parts(self) -> dict[str, Float[ndarray, "T"]]:
        """The three parts of the score: missing force, missing moment, torque beyond the motor's, each in its gate."""
        force, moment = np.linalg.norm(self.residual.reshape(-1, 2, 3), axis=-1).T
        return {
            "force": force / (_RULES.force_gate * self.weight),
            "moment": moment / (_RULES.moment_gate * self.weight),
            "effort": np.maximum(self.effort_share - 1.0, 0.0) / _RULES.effort_gate,
        }

    @property
    def score(self) -> Float[ndarray, "T"]:
        """The worst part per frame: 0 is a motion that the laws of motion allow, 1 and more one that cannot be."""
        return np.max(list(self.parts.values()), axis=0)

    @property
    def flight(self) -> Bool[ndarray, "T"]:
        """Frames in which no point touches."""
        return ~np.asarray(self.in_contact.any(axis=1))


def dynamics_of(reference: Reference, robot: RobotModel) -> Dynamics:
    """Rigid-body dynamics of a reference with the contact forces that suit it best.

    Args:
        reference: the motion. Velocities and accelerations are differences of its stored curve, second order inside
            every continuous piece; a piece's first and last frames have their neighbour's acceleration, and one of
            fewer than three frames is taken at rest.
        robot: its robot.

    Raises:
        RetargetError: the reference is another robot's.
        RobotError: Pinocchio is not installed.
    """
    if reference.robot_hash != robot.hash:
        raise RetargetError(
            f"reference of robot '{reference.robot}'", found=f"robot '{robot.name}' with other names, tree or limits",
            expected="the robot that the reference was made for", cure="load that robot",
        )  # fmt: skip
    qpos = np.asarray(reference.qpos, dtype=float)
    qpos[:, 3:7] = rot.normalise(qpos[:, 3:7])
    qvel, qacc = np.zeros((2, len(qpos), robot.nq - 1))
    for a, b in continuous_ranges(reference):
        qvel[a:b], qacc[a:b] = differences(qpos[a:b], 1.0 / reference.fps)
    demand = inverse_dynamics(robot, qpos, qvel, qacc)
    points = floor_points(reference, robot)
    forces, torque, error = contact_forces(
        robot, qpos, points, demand, force_gate=_RULES.force_gate, moment_gate=_RULES.moment_gate
    )
    needed = np.concatenate((demand.force_w, demand.moment_w), axis=1)
    arm = points.pos_w - demand.com_w[:, None]
    given = np.concatenate((forces.sum(axis=1), rot.cross(arm, forces).sum(axis=1)), axis=1)
    zmp = _zmp(demand, ~np.asarray(points.in_contact.any(axis=1)))
    share = robot.torque_share(torque)
    return Dynamics(
        fps=reference.fps,
        joint_names=robot.joint_names,
        weight=demand.weight,
        joint_torque=torque,
        in_contact=points.in_contact,
        point_w=points.pos_w,
        force_w=forces,
        net_wrench_w=needed,
        residual=needed - given,
        com_w=demand.com_w,
        zmp_w=zmp,
        zmp_outside=outside_support(zmp, points.pos_w[..., :2], points.in_contact),
        effort_share=share.max(axis=1),
        worst_joint=tuple(_and_its_pair(robot, int(j)) for j in share.argmax(axis=1)),
        solve_error=error,
    )


def _and_its_pair(robot: RobotModel, joint: int) -> str:
    """The joints whose torques count in a joint's share."""
    return " and ".join(robot.joint_names[j] for j in np.flatnonzero(robot.sharing[joint]))


def torque_misfit(reference: Reference, robot: RobotModel) -> float:
    """The largest difference of a reference's torques from the inverse dynamics of its motion, in the motors' efforts."""
    stored = np.zeros_like(reference.joint_pos) if reference.joint_torque is None else reference.joint_torque
    return float((np.abs(dynamics_of(reference, robot).joint_torque - stored) / robot.effort).max())


def differences(qpos: Float[ndarray, "T nq"], dt: float) -> tuple[Float[ndarray, "T nv"], Float[ndarray, "T nv"]]:
    """Velocities and accelerations in MuJoCo's layout: root linear in the world, root angular in the body frame.

    With the turns forward = log(q(t)^-1 q(t+1)) and backward = log(q(t-1)^-1 q(t)), both in the body frame at t, their
    mean over dt is the angular velocity and their difference over dt^2 its derivative, both to second order: the log's
    own bending is cubic in dt (Iserles et al., "Lie-group methods", 2000, eq. 4.6).
    """
    qvel, qacc = np.zeros((2, len(qpos), qpos.shape[1] - 1))
    if len(qpos) < 3:
        return qvel, qacc
    steps = np.concatenate(
        (
            np.diff(qpos[:, :3], axis=0),
            rot.log(rot.multiply(rot.conjugate(qpos[:-1, 3:7]), qpos[1:, 3:7])),
            np.diff(qpos[:, 7:], axis=0),
        ),
        axis=1,
    )
    qvel[1:-1] = (steps[1:] + steps[:-1]) / (2.0 * dt)
    qacc[1:-1] = (steps[1:] - steps[:-1]) / dt**2
    qacc[0], qacc[-1] = qacc[1], qacc[-2]
    # The one-sided formulas of second order, (-3 x0 + 4 x1 - x2) / 2 dt and its mirror.
    qvel[0], qvel[-1] = qvel[1] - dt * qacc[1], qvel[-2] + dt * qacc[-2]
    return qvel, qacc


def inverse_dynamics(
    robot: RobotModel, qpos: Float[ndarray, "T nq"], qvel: Float[ndarray, "T nv"], qacc: Float[ndarray, "T nv"]
) -> Demand:
    """The contact wrench and the joint torques that a motion needs, by recursive Newton-Euler (Featherstone 2008, 5.3).

    The contact wrench is that of all contact forces together, because nothing else holds the root; the torques are
    those with the wrench on the root, before any foot's share of it.

    Args:
        robot: the robot.
        qpos: root position [m], root wxyz, joint angles [rad].
        qvel: in MuJoCo's layout [m/s, rad/s].
        qacc: its time derivative, component by component [m/s^2, rad/s^2].

    Raises:
        RobotError: Pinocchio is not installed.
    """
    model = pinocchio_model(robot)
    import pinocchio as pin

    data = model.createData()
    q, v, a = pinocchio_q(qpos), pinocchio_v(qpos, qvel), pinocchio_v(qpos, qacc)
    # Pinocchio's linear velocity is R^T v, so its derivative has a part from the turning frame.
    a[:, :3] -= rot.cross(v[:, 3:6], v[:, :3])
    com, tau = np.zeros((len(q), 3)), np.zeros((len(q), model.nv))
    for t in range(len(q)):  # Pinocchio takes one configuration at a time
        tau[t] = pin.rnea(model, data, q[t], v[t], a[t])
        com[t] = pin.centerOfMass(model, data, q[t])
    force_w, moment_w = rot.rotate(qpos[:, 3:7], tau[:, :3]), rot.rotate(qpos[:, 3:7], tau[:, 3:6])
    return Demand(
        weight=float(pin.computeTotalMass(model) * np.linalg.norm(model.gravity.linear)),
        com_w=com,
        force_w=force_w,
        moment_w=moment_w + rot.cross(qpos[:, :3] - com, force_w),
        torque=tau[:, 6:],
    )


def _zmp(demand: Demand, flight: Bool[ndarray, "T"]) -> Float[ndarray, "T 2"]:
    """Where on the floor z = 0 the contact wrench has no horizontal moment (Vukobratovic & Borovac 2004)."""
    com, force, moment = demand.com_w, demand.force_w, demand.moment_w
    carried = np.where(flight | (force[:, 2] < _RULES.carried * demand.weight), np.nan, force[:, 2])
    sideways = np.stack((-moment[:, 1], moment[:, 0]), axis=1) - com[:, 2:] * force[:, :2]
    return com[:, :2] + sideways / carried[:, None]
