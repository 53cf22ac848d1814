"""The rows of the whole-clip solver's least-squares problem: weighted errors of the goals, and their derivatives.

Every row is something that a body follows along a wrench (robot_models/rigid_body/jacobians.py): a point along an axis of the
world, a turn about one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from retarget.config import ObjectiveWeights
from retarget.solver.objective import Objective
from retarget.targets import LIMBS
from robot_models import Kinematics, forces, surface_points
from robot_models.maths import rotation as rot

_X = np.array([1.0, 0.0, 0.0])
_COUPLES = np.eye(3, 6)  # wrenches of unit couples about the world's axes


def residual_rows(objective: Objective, kin: Kinematics) -> tuple[Float[ndarray, "T R"], Float[ndarray, "T R nv"], int]:
    """Weighted errors, their derivatives, and how many rows are the body's: the feet's come after them."""
    body = (_limbs(objective, kin), _pelvis(objective, kin), _trunk(objective, kin))
    groups = (*body, *_feet(objective, kin))
    frames = len(kin.pos)
    error = np.concatenate([(g.weight * g.error).reshape(frames, -1) for g in groups], axis=1)
    wrenches = np.concatenate([g.wrenches for g in groups], axis=1)
    jacobian = kin.derivatives(np.concatenate([g.rows_of for g in groups]), wrenches)
    # A limb is the way from one body to another: where it begins takes its part off again.
    starts = _starts(objective, kin)
    jacobian[:, : len(starts.rows_of)] -= kin.derivatives(starts.rows_of, starts.wrenches)
    if objective.part_weight.shape[1]:
        off, by = _parts(objective, kin)
        error, jacobian = np.concatenate((error, off), axis=1), np.concatenate((jacobian, by), axis=1)
    return error, jacobian, sum(len(g.rows_of) for g in body)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """n bodies with k rows each: what is off, and the wrench that each row follows."""

    bodies: Int[ndarray, "n"]
    error: Float[ndarray, "T n k"]
    along: Float[ndarray, "T n k 6"]
    weight: ndarray  # of the errors, as far as they broadcast

    @property
    def rows_of(self) -> Int[ndarray, "nk"]:
        """The body of every row."""
        return np.repeat(self.bodies, self.error.shape[2])

    @property
    def wrenches(self) -> Float[ndarray, "T nk 6"]:
        """Weighted, one for each row."""
        return (self.weight[..., None] * self.along).reshape(len(self.error), -1, 6)


def _limbs(objective: Objective, kin: Kinematics) -> _Group:
    (_, starts), (bodies, ends) = (_landmarks(kin, k) for k in (0, 1))
    error = ends - starts - objective.limbs
    return _Group(bodies=bodies, error=error, along=forces(ends), weight=_limb_weights(objective.weights))


def _starts(objective: Objective, kin: Kinematics) -> _Group:
    bodies, pos = _landmarks(kin, 0)
    return _Group(bodies=bodies, error=pos, along=forces(pos), weight=_limb_weights(objective.weights))


def _landmarks(kin: Kinematics, end: int) -> tuple[Int[ndarray, "L"], Float[ndarray, "T L 3"]]:
    """The bodies that limbs begin or end on, and where."""
    names = [limb[end] for limb in LIMBS]
    return np.array([kin.robot.landmark(name) for name in names]), kin.robot.landmark_pos(names, kin.pos, kin.quat)


def _limb_weights(w: ObjectiveWeights) -> Float[ndarray, "L 1"]:
    return np.array([[w.leg if start.endswith(("hip", "knee")) else w.arm] for start, _ in LIMBS])


def _pelvis(objective: Objective, kin: Kinematics) -> _Group:
    pos = kin.pos[:, :1]
    weight = np.array(objective.weights.pelvis_position)
    return _Group(bodies=np.array([0]), error=pos - objective.pelvis_pos[:, None], along=forces(pos), weight=weight)


def _trunk(objective: Objective, kin: Kinematics) -> _Group:
    bodies = np.array([0, kin.robot.landmark("torso")])
    error = _turn(kin.quat[:, bodies], np.stack((objective.pelvis_quat, objective.torso_quat), axis=1))
    weight = np.array([[objective.weights.pelvis_orientation], [objective.weights.torso_orientation]])
    return _Group(bodies=bodies, error=error, along=np.broadcast_to(_COUPLES, (*error.shape, 6)), weight=weight)


def _feet(objective: Objective, kin: Kinematics) -> tuple[_Group, _Group]:
    """Heels and toes, and the roll about the line through them, which they leave free."""
    soles = kin.robot.soles.values()
    feet = np.array([kin.robot.body(sole.body) for sole in soles])
    of_edges = np.repeat(feet, 2)
    edges = np.array([edge for sole in soles for edge in (sole.heel, sole.toe)])
    points = kin.pos[:, of_edges] + rot.rotate(kin.quat[:, of_edges], edges)
    line = rot.rotate(objective.foot_quat, np.broadcast_to(_X, (*objective.foot_quat.shape[:2], 3)))[:, :, None]
    roll = (_turn(kin.quat[:, feet], objective.foot_quat)[:, :, None] * line).sum(axis=3)
    return (
        _Group(bodies=of_edges, error=points - objective.edges, along=forces(points), weight=objective.edge_weight),
        _Group(bodies=feet, error=roll, along=line @ _COUPLES, weight=objective.roll_weight[..., None]),
    )


def _parts(objective: Objective, kin: Kinematics) -> tuple[Float[ndarray, "T K"], Float[ndarray, "T K nv"]]:
    """How high the lowest points of parts are over where they shall be, and how far bodies are from where they stand."""
    surface = surface_points(kin.robot)
    height = surface.heights(kin.pos, kin.quat)[:, None]
    own = surface.body == objective.part_body[..., None]
    lowest = np.where(own, height, np.inf).argmin(axis=2)
    point, body = surface.offset[lowest], objective.part_body
    frame = np.arange(len(kin.pos))[:, None]
    at = kin.pos[frame, body] + rot.rotate(kin.quat[frame, body], point)
    by = kin.derivatives(body, forces(at)[..., 2, :])
    off = np.take_along_axis(height[:, 0], lowest, axis=1) - objective.part_height
    origin = kin.pos[frame, body]
    away = (origin[..., :2] - objective.part_place).reshape(len(off), -1)
    across = kin.derivatives(np.repeat(body, 2, axis=1), forces(origin)[..., :2, :].reshape(*away.shape, 6))
    weight = np.concatenate((objective.part_weight, np.repeat(objective.part_place_weight, 2, axis=1)), axis=1)
    return weight * np.concatenate((off, away), axis=1), weight[..., None] * np.concatenate((by, across), axis=1)


def _turn(quat: ndarray, wanted: ndarray) -> ndarray:
    """Rotation vector in the world from `wanted` to `quat` [rad]."""
    return rot.log(rot.multiply(quat, rot.conjugate(wanted)))
