"""The forces of the touching sole points that come nearest to a wrench, within their friction cones: all frames at once.

T frames, P sole points, J joints. Distances between wrenches are counted in gates: so much force, so much moment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from retarget.dynamics.floor_points import FloorPoints, layout_of
from robot_models import Kinematics, RobotModel, ancestors, kinematics, moved
from robot_models.maths import rotation as rot

_EDGES = 4  # generators of the friction pyramid; they lie on the cone, so the pyramid is inside it
# Squared norms beside the squared residual. They choose among forces that all do: first by the torques they ask for,
# then by their size. The residual they cost is of the order of 1e-5 gates.
_PER_EFFORT, PER_WEIGHT = 1e-5, 1e-6
# Largest entry of the dual's gradient, in gates; the second is rounding, of what cancels in it.
_ENOUGH, _ROUNDING = 1e-9, 4e-15
_MOST_STEPS = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class Demand:
    """What a motion asks of the floor and of the motors before any contact force. T frames, J joints."""

    weight: float  # [N]
    com_w: Float[ndarray, "T 3"]  # [m]
    force_w: Float[ndarray, "T 3"]  # sum of all contact forces [N]
    moment_w: Float[ndarray, "T 3"]  # of all contact forces about the CoM [N m]
    torque: Float[ndarray, "T J"]  # [N m], were the contact wrench to act on the root


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceCone:
    """What shares of the weight along the generators of the friction pyramids come to. N generators, L joints of the legs.

    The shares of points that do not touch give nothing.
    """

    weight: float  # [N]
    edges_w: Float[ndarray, "T P 4 3"]  # generators; 0 where a point does not touch
    wrench: Float[ndarray, "T 6 N"]  # moment about the CoM and force [gates] per share
    torque: Float[ndarray, "T L N"]  # of the legs' joints [N m] per share
    joints: Int[ndarray, "L"]  # between the root and what carries
    per_torque: Float[ndarray, "L"]  # what a torque counts beside the gates

    def at(self, frames: Int[ndarray, "F"]) -> ForceCone:
        """Some of the frames."""
        return replace(self, edges_w=self.edges_w[frames], wrench=self.wrench[frames], torque=self.torque[frames])

    def forces(self, share: Float[ndarray, "T N"]) -> Float[ndarray, "T P 3"]:
        """The points' forces [N]."""
        return np.asarray(self.weight * (share.reshape(*self.edges_w.shape[:3], 1) * self.edges_w).sum(axis=2))

    @property
    def matrix(self) -> Float[ndarray, "T R N"]:
        """Gates and torques, as they count, by shares."""
        return np.concatenate((self.wrench, self.torque * self.per_torque[:, None]), axis=1)

    def shares(
        self, wrench: Float[ndarray, "T 6"], torque: Float[ndarray, "T J"], start: Float[ndarray, "T R"] | None = None
    ) -> tuple[Float[ndarray, "T N"], Float[ndarray, "T R"], Float[ndarray, "T"]]:
        """The shares that come nearest to a wrench [gates] with small torques, their dual, how far from the best they are.

        They make least |missing wrench|^2 + 1e-5 |torque / effort|^2 + 1e-6 |shares|^2.

        Args:
            wrench: wanted, moment before force.
            torque: of all joints, were the wrench to act on the root.
            start: the dual of nearly the same problem, which saves most of the work.
        """
        target = np.concatenate((wrench, -torque[:, self.joints] * self.per_torque), axis=1)
        return nonnegative_ridge(self.matrix, target, PER_WEIGHT, start)


def force_cone(
    kin: Kinematics, points: FloorPoints, com_w: Float[ndarray, "T 3"], weight: float, gates: Float[ndarray, "6"]
) -> ForceCone:
    """The cone of what touching sole points can give.

    Args:
        kin: poses of the frames.
        points: the sole points in the same frames.
        com_w: the point that moments are about [m].
        weight: of the robot [N].
        gates: a gate's moment and force [N m, N], per axis.
    """
    robot = kin.robot
    joints = carrying_joints(robot, points.pos_w.shape[1])
    edges = friction_pyramid(points.yaw, robot.profile.friction) * points.in_contact[..., None, None]
    arm = points.pos_w - com_w[:, None]
    about_com = np.concatenate((rot.cross(arm[:, :, None], edges), edges), axis=-1)
    about_origin = np.concatenate((rot.cross(points.pos_w[:, :, None], edges), edges), axis=-1)
    # What a force takes off a joint's torque is its wrench along the joint's screw.
    screws = kin.screws[:, None, 6 + joints].swapaxes(2, 3) * moved(robot)[points.body][:, :, None, 6 + joints]
    return ForceCone(
        weight=weight,
        edges_w=edges,
        wrench=_columns(about_com) * (weight / gates)[:, None],
        torque=-weight * _columns(about_origin @ screws),
        joints=joints,
        per_torque=np.sqrt(_PER_EFFORT) / robot.effort[joints],
    )


def carrying_joints(robot: RobotModel, points: int) -> Int[ndarray, "L"]:
    """The joints between the root and so many points: those of the legs, or all where more than soles may carry."""
    if points > len(layout_of(robot).body):
        return np.arange(len(robot.joint_names))
    return np.flatnonzero(ancestors(robot)[list(layout_of(robot).body)].any(axis=0))


def contact_forces(
    robot: RobotModel,
    qpos: Float[ndarray, "T nq"],
    points: FloorPoints,
    demand: Demand,
    *,
    force_gate: float,
    moment_gate: float,
) -> tuple[Float[ndarray, "T P 3"], Float[ndarray, "T J"], Float[ndarray, "T"]]:
    """Contact forces [N], world; the joint torques [N m] with them; how far from the best they are [gates].

    Args:
        robot: the robot.
        qpos: root position [m], root wxyz, joint angles [rad].
        points: the sole points in the same frames.
        demand: what the motion asks for.
        force_gate: as a share of the weight.
        moment_gate: as a share of the weight times 1 m [m].
    """
    gates = demand.weight * np.repeat((moment_gate, force_gate), 3)
    out, torque, error = np.zeros_like(points.pos_w), demand.torque.copy(), np.zeros(len(qpos))
    on = np.flatnonzero(points.in_contact.any(axis=1))
    if not len(on):
        return out, torque, error
    cone = force_cone(kinematics(robot, qpos[on]), points.at(on), demand.com_w[on], demand.weight, gates)
    wanted = np.concatenate((demand.moment_w[on], demand.force_w[on]), axis=1) / gates
    share, _, error[on] = cone.shares(wanted, torque[on])
    out[on] = cone.forces(share)
    torque[on[:, None], cone.joints] += (cone.torque @ share[..., None])[..., 0]
    return out, torque, error


def _columns(of_generators: ndarray) -> ndarray:
    """(T, P, E, m) -> (T, m, P E)."""
    t, p, e, m = of_generators.shape
    return of_generators.reshape(t, p * e, m).swapaxes(1, 2)


def friction_pyramid(yaw: Float[ndarray, "T P"], friction: float) -> Float[ndarray, "T P 4 3"]:
    """Generators (horizontal part `friction`, vertical part 1) of the forces that a point on the floor can take.

    Edges point along, against and across the foot's heading, so that the answer does not turn with the world.
    """
    angle = yaw[..., None] + 2.0 * np.pi / _EDGES * np.arange(_EDGES)
    return np.stack((friction * np.cos(angle), friction * np.sin(angle), np.ones_like(angle)), axis=-1)


def nonnegative_ridge(
    matrix: Float[ndarray, "T m n"],
    target: Float[ndarray, "T m"],
    ridge: float,
    start: Float[ndarray, "T m"] | None = None,
) -> tuple[Float[ndarray, "T n"], Float[ndarray, "T m"], Float[ndarray, "T"]]:
    """For every frame the x >= 0 that makes |matrix x - target|^2 + ridge |x|^2 least, and how far from solved.

    x = max(0, matrix^T y), where y makes the convex, piecewise quadratic dual
    |max(0, matrix^T y)|^2 / 2 + ridge |y|^2 / 2 - target y least; its semismooth Newton steps (Qi & Sun 1993), cut
    back to where the dual is least along them, end on the exact answer after finitely many. All frames go at once;
    those that are solved leave.

    Returns:
        x, y, and the largest entry of the dual's gradient, which is an error in the units of `target`.
    """
    frames, rows, _ = matrix.shape
    y = np.zeros((frames, rows)) if start is None else start.copy()
    error, todo = np.zeros(frames), np.arange(frames)
    small = ridge * np.eye(rows)
    m, b, v = matrix, target, y.copy()
    pulled = _times(m.swapaxes(1, 2), v)  # matrix^T y
    for _ in range(_MOST_STEPS):
        x = np.maximum(pulled, 0.0)
        gradient = _times(m, x) + ridge * v - b
        error[todo] = np.abs(gradient).max(axis=1)
        y[todo] = v
        on = error[todo] > _ENOUGH + _ROUNDING * np.abs(pulled).max(axis=1)
        if not on.any():
            break
        m, b, v, pulled, gradient, todo = m[on], b[on], v[on], pulled[on], gradient[on], todo[on]
        held = (pulled > 0.0) | ~pulled.any(axis=1, keepdims=True)  # all of them, where nothing is known yet
        masked = m * held[:, None]
        step = -np.linalg.solve(masked @ m.swapaxes(1, 2) + small, gradient[..., None])[..., 0]
        length = _cut_back(m, b, v, pulled, step, ridge)
        v = v + length[:, None] * step
        pulled = _times(m.swapaxes(1, 2), v)
    return np.maximum(_times(matrix.swapaxes(1, 2), y), 0.0), y, error


def _cut_back(m: ndarray, b: ndarray, v: ndarray, pulled: ndarray, step: ndarray, ridge: float) -> ndarray:
    """The length in (0, 1] at which the dual is least along the step, exactly.

    Its slope there is continuous, rises, and is linear between the lengths at which an entry of matrix^T y changes
    sign. Values of the dual would not do: the ridge's part is large and drowns the rest.
    """
    moved = _times(m.swapaxes(1, 2), step)
    steady = np.sum(step * (ridge * v - b), axis=1)
    rising = ridge * np.sum(step**2, axis=1)
    length = np.ones(len(v))
    on = np.flatnonzero(np.sum(moved * np.maximum(pulled + moved, 0.0), axis=1) + steady + rising > 0.0)
    if not len(on):
        return length
    pulled, moved = pulled[on], moved[on]
    with np.errstate(divide="ignore", invalid="ignore"):
        turns = -pulled / moved
    within = (turns > 0.0) & (turns < 1.0)
    # The slope is at + by * length; each entry that turns takes its share of both away, or brings it.
    share = np.stack((moved * pulled, moved**2))
    begun = (pulled > 0.0) | ((pulled == 0.0) & (moved > 0.0))
    first = (share * begun).sum(axis=2) + np.stack((steady[on], rising[on]))
    order = np.argsort(np.where(within, turns, np.inf), axis=1)
    change = np.take_along_axis(share * np.where(within, np.sign(moved), 0.0), order[None], axis=2)
    at, by = np.concatenate((first[..., None], first[..., None] + np.cumsum(change, axis=2)), axis=2)
    knots = np.take_along_axis(np.where(within, turns, 1.0), order, axis=1)
    rises = at[:, :-1] + by[:, :-1] * knots > 0.0  # at each knot: the first that does ends the piece with the least
    piece = np.where(rises.any(axis=1), np.argmax(rises, axis=1), rises.shape[1])[:, None]
    at, by = (np.take_along_axis(x, piece, axis=1)[:, 0] for x in (at, by))
    length[on] = np.clip(-at / np.where(by > 0.0, by, 1.0), 0.0, 1.0)
    return length


def _times(matrix: ndarray, vector: ndarray) -> ndarray:
    return (matrix @ vector[..., None])[..., 0]
