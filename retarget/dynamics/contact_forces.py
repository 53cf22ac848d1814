"""The forces of the touching sole points that come nearest to a wrench, within their friction cones: all frames at once.

T frames, P sole points, J joints. Distances between wrenches are counted in gates: so much force, so much moment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from retarget.dynamics.support import SolePoints
from robot_models import RobotModel, ancestors, joint_axes
from robot_models.maths import rotation as rot

_EDGES = 4  # generators of the friction pyramid; they lie on the cone, so the pyramid is inside it
# Squared norms beside the squared residual. They choose among forces that all do: first by the torques they ask for,
# then by their size. The residual they cost is of the order of 1e-5 gates.
_PER_EFFORT, _PER_WEIGHT = 1e-5, 1e-6
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


def contact_forces(
    robot: RobotModel,
    qpos: Float[ndarray, "T nq"],
    points: SolePoints,
    demand: Demand,
    *,
    force_gate: float,
    moment_gate: float,
) -> tuple[Float[ndarray, "T P 3"], Float[ndarray, "T J"], Float[ndarray, "T"]]:
    """Contact forces [N], world; the joint torques [N m] with them; how far from the best they are [gates].

    The forces make least |missing force / force gate|^2 + |missing moment / moment gate|^2 + 1e-5 |torque / effort|^2
    + 1e-6 |force / weight|^2 over the friction pyramids of the touching points, where the torques are those of the
    joints between root and soles.

    Args:
        robot: the robot.
        qpos: root position [m], root wxyz, joint angles [rad].
        points: the sole points in the same frames.
        demand: what the motion asks for.
        force_gate: as a share of the weight.
        moment_gate: as a share of the weight times 1 m [m].
    """
    levers = _torque_per_force(robot, qpos, points)
    legs = np.flatnonzero(ancestors(robot)[list(points.body)].any(axis=0))
    out, torque, error = np.zeros_like(points.pos_w), demand.torque.copy(), np.zeros(len(qpos))
    on = np.flatnonzero(points.in_contact.any(axis=1))
    if not len(on):
        return out, torque, error
    edges = friction_pyramid(points.yaw[on], robot.profile.friction) * points.in_contact[on][..., None, None]
    arm = points.pos_w[on] - demand.com_w[on, None]
    per_torque = np.sqrt(_PER_EFFORT) / robot.effort[legs]
    matrix = np.concatenate(
        (
            _columns(edges) / force_gate,
            _columns(rot.cross(arm[:, :, None], edges)) / moment_gate,
            _columns(edges @ levers[on][:, :, legs].swapaxes(2, 3)) * per_torque[:, None] * demand.weight,
        ),
        axis=1,
    )
    wanted = np.concatenate(
        (
            demand.force_w[on] / (force_gate * demand.weight),
            demand.moment_w[on] / (moment_gate * demand.weight),
            -torque[on][:, legs] * per_torque,
        ),
        axis=1,
    )
    share, error[on] = nonnegative_ridge(matrix, wanted, _PER_WEIGHT)
    out[on] = demand.weight * np.sum(share.reshape(*edges.shape[:3], 1) * edges, axis=2)
    torque += np.einsum("tpjk,tpk->tj", levers, out)
    return out, torque, error


def _columns(of_generators: ndarray) -> ndarray:
    """(T, P, E, m) -> (T, m, P E)."""
    t, p, e, m = of_generators.shape
    return of_generators.reshape(t, p * e, m).swapaxes(1, 2)


def _torque_per_force(robot: RobotModel, qpos: ndarray, points: SolePoints) -> Float[ndarray, "T P J 3"]:
    """What a force on a sole point takes off a joint's torque: -axis x (point - anchor), by the triple product."""
    _, _, axes, anchors = joint_axes(robot, qpos)
    carries = ancestors(robot)[list(points.body)]
    arm = points.pos_w[:, :, None] - anchors[:, None]
    return -rot.cross(axes[:, None], arm) * carries[..., None]


def friction_pyramid(yaw: Float[ndarray, "T P"], friction: float) -> Float[ndarray, "T P 4 3"]:
    """Generators (horizontal part `friction`, vertical part 1) of the forces that a point on the floor can take.

    Edges point along, against and across the foot's heading, so that the answer does not turn with the world.
    """
    angle = yaw[..., None] + 2.0 * np.pi / _EDGES * np.arange(_EDGES)
    return np.stack((friction * np.cos(angle), friction * np.sin(angle), np.ones_like(angle)), axis=-1)


def nonnegative_ridge(
    matrix: Float[ndarray, "T m n"], target: Float[ndarray, "T m"], ridge: float
) -> tuple[Float[ndarray, "T n"], Float[ndarray, "T"]]:
    """For every frame the x >= 0 that makes |matrix x - target|^2 + ridge |x|^2 least, and how far from solved.

    x = max(0, matrix^T y), where y makes the convex, piecewise quadratic dual
    |max(0, matrix^T y)|^2 / 2 + ridge |y|^2 / 2 - target y least; its semismooth Newton steps (Qi & Sun 1993), cut
    back to where the dual is least along them, end on the exact answer after finitely many. All frames go at once;
    those that are solved leave.

    Returns:
        x, and the largest entry of the dual's gradient, which is an error in the units of `target`.
    """
    frames, rows, _ = matrix.shape
    y, error, todo = np.zeros((frames, rows)), np.zeros(frames), np.arange(frames)
    small = ridge * np.eye(rows)
    m, b, v = matrix, target, y.copy()
    pulled = np.zeros((frames, matrix.shape[2]))  # matrix^T y
    for round_ in range(_MOST_STEPS):
        x = np.maximum(pulled, 0.0)
        gradient = _times(m, x) + ridge * v - b
        error[todo] = np.abs(gradient).max(axis=1)
        y[todo] = v
        on = error[todo] > _ENOUGH + _ROUNDING * np.abs(pulled).max(axis=1)
        if not on.any():
            break
        m, b, v, pulled, gradient, todo = m[on], b[on], v[on], pulled[on], gradient[on], todo[on]
        held = pulled > 0.0 if round_ else np.ones_like(pulled, dtype=bool)
        masked = m * held[:, None]
        step = -np.linalg.solve(masked @ m.swapaxes(1, 2) + small, gradient[..., None])[..., 0]
        length = _cut_back(m, b, v, pulled, step, ridge)
        v = v + length[:, None] * step
        pulled = _times(m.swapaxes(1, 2), v)
    return np.maximum(_times(matrix.swapaxes(1, 2), y), 0.0), error


def _cut_back(m: ndarray, b: ndarray, v: ndarray, pulled: ndarray, step: ndarray, ridge: float) -> ndarray:
    """The length in (0, 1] at which the dual is least along the step, exactly.

    Its slope there is continuous, rises, and is linear between the lengths at which an entry of matrix^T y changes
    sign. Values of the dual would not do: the ridge's part is large and drowns the rest.
    """
    length, moved = np.ones(len(v)), _times(m.swapaxes(1, 2), step)

    def slope(at: ndarray, on: ndarray | slice) -> ndarray:
        x = np.maximum(pulled[on, None] + at[..., None] * moved[on, None], 0.0)
        steady = ridge * np.sum(step[on] * v[on], axis=1) - np.sum(step[on] * b[on], axis=1)
        rising = ridge * np.sum(step[on] ** 2, axis=1)
        return np.sum(moved[on, None] * x, axis=-1) + steady[:, None] + at * rising[:, None]

    on = np.flatnonzero(slope(length[:, None], slice(None))[:, 0] > 0.0)
    if len(on):
        with np.errstate(divide="ignore", invalid="ignore"):
            turns = -pulled[on] / moved[on]
        turns = np.where((turns > 0.0) & (turns < 1.0), turns, 0.0)
        knots = np.sort(np.concatenate((turns, np.zeros((len(on), 1)), np.ones((len(on), 1))), axis=1), axis=1)
        rise = slope(knots, on)
        after = np.argmax(rise > 0.0, axis=1)[:, None]  # the slope at 0 is negative, that at 1 positive
        before = np.maximum(after - 1, 0)
        s0, s1, r0, r1 = (np.take_along_axis(x, k, axis=1)[:, 0] for x in (knots, rise) for k in (before, after))
        length[on] = s0 - r0 * (s1 - s0) / np.where(r1 > r0, r1 - r0, 1.0)
    return length


def _times(matrix: ndarray, vector: ndarray) -> ndarray:
    return (matrix @ vector[..., None])[..., 0]
