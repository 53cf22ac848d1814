"""What the whole-clip solver pulls towards, and the rows of its least-squares problem."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import PIVOTING
from retarget.config import GoalWeights
from retarget.feet import edge_share
from retarget.free_joints import free_joints
from retarget.targets import LIMBS, Targets
from robot_models import FEET, RobotModel
from robot_models import rotation as rot
from robot_models.jacobians import Kinematics, forces

_X = np.array([1.0, 0.0, 0.0])
_COUPLES = np.eye(3, 6)  # wrenches of unit couples about the world's axes


@dataclass(frozen=True, kw_only=True, eq=False)
class Goals:
    """Wanted poses on T frames, and the weights of those that change in time."""

    weights: GoalWeights
    pelvis_pos: Float[ndarray, "T 3"]
    pelvis_quat: Float[ndarray, "T 4"]
    torso_quat: Float[ndarray, "T 4"]
    limbs: Float[ndarray, "T L 3"]  # vectors, in the order of LIMBS [m]
    edges: Float[ndarray, "T 4 3"]  # heel and toe of the left and the right sole [m]
    foot_quat: Float[ndarray, "T 2 4"]
    posture: Float[ndarray, "T J"]
    edge_weight: Float[ndarray, "T 4 3"]
    roll_weight: Float[ndarray, "T 2"]
    posture_weight: Float[ndarray, "T J"]

    def at(self, frames: Int[ndarray, "F"]) -> Goals:
        """The same goals on some of the frames."""
        picked = {f.name: getattr(self, f.name)[frames] for f in fields(self) if f.name != "weights"}
        return Goals(weights=self.weights, **picked)

    def rows(self, kin: Kinematics) -> tuple[Float[ndarray, "T R"], Float[ndarray, "T R nv"], int]:
        """Weighted residuals, their derivatives, and how many rows are the body's: the feet's come after them."""
        body, foot = self._body_groups(kin), self._foot_groups(kin)
        groups, frames = (*body, *foot), len(kin.pos)
        residual = np.concatenate([(g.weight * g.error).reshape(frames, -1) for g in groups], axis=1)
        pulls = np.concatenate([(g.weight[..., None] * g.pull).reshape(frames, -1, 6) for g in groups], axis=1)
        jacobian = kin.derivatives(np.concatenate([np.repeat(g.bodies, g.error.shape[2]) for g in groups]), pulls)
        # A limb is the way from one body to another: its other end takes its part off again.
        starts = np.array([kin.robot.landmark(start) for start, _ in LIMBS])
        rows = slice(3, 3 + 3 * len(starts))
        pulls = (_limb_weight(self.weights)[..., None] * forces(kin.pos[:, starts])).reshape(frames, -1, 6)
        jacobian[:, rows] -= kin.derivatives(np.repeat(starts, 3), pulls)
        return residual, jacobian, sum(g.error.shape[1] * g.error.shape[2] for g in body)

    def _body_groups(self, kin: Kinematics) -> tuple[_Group, ...]:
        w, at = self.weights, kin.robot.landmark
        starts, ends = (np.array([at(limb[k]) for limb in LIMBS]) for k in (0, 1))
        trunk = np.array([0, at("torso")])
        turn = _turn(kin.quat[:, trunk], np.stack((self.pelvis_quat, self.torso_quat), axis=1))
        return (
            _Group(
                bodies=np.array([0]),
                error=kin.pos[:, :1] - self.pelvis_pos[:, None],
                pull=forces(kin.pos[:, :1]),
                weight=np.full((1, 1), w.pelvis_position),
            ),
            _Group(
                bodies=ends,
                error=kin.pos[:, ends] - kin.pos[:, starts] - self.limbs,
                pull=forces(kin.pos[:, ends]),
                weight=_limb_weight(w),
            ),
            _Group(
                bodies=trunk,
                error=turn,
                pull=np.broadcast_to(_COUPLES, (*turn.shape, 6)),
                weight=np.array([[w.pelvis_orientation], [w.torso_orientation]]),
            ),
        )

    def _foot_groups(self, kin: Kinematics) -> tuple[_Group, ...]:
        soles = kin.robot.soles.values()
        feet = np.array([kin.robot.body(sole.body) for sole in soles])
        carrying = np.repeat(feet, 2)
        ends = np.array([end for sole in soles for end in (sole.heel, sole.toe)])
        points = kin.pos[:, carrying] + rot.rotate(kin.quat[:, carrying], ends)
        # Two points leave the foot free to roll about the line through them.
        along = rot.rotate(self.foot_quat, np.broadcast_to(_X, (*self.foot_quat.shape[:2], 3)))
        roll = (_turn(kin.quat[:, feet], self.foot_quat) * along).sum(axis=2)
        return (
            _Group(bodies=carrying, error=points - self.edges, pull=forces(points), weight=self.edge_weight),
            _Group(
                bodies=feet,
                error=roll[..., None],
                pull=(along[:, :, None] @ _COUPLES),
                weight=self.roll_weight[..., None],
            ),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """n bodies with k rows each: what is off, and the wrench that each row follows."""

    bodies: Int[ndarray, "n"]
    error: Float[ndarray, "T n k"]
    pull: Float[ndarray, "T n k 6"]
    weight: ndarray  # of the errors, as far as they broadcast


def make_goals(
    robot: RobotModel,
    targets: Targets,
    weights: GoalWeights,
    posture: Float[ndarray, "T J"],
    pins: Float[ndarray, "T J"] | None = None,
) -> Goals:
    """Weigh the targets.

    Args:
        robot: the robot.
        targets: where pelvis, trunk, limbs and feet shall be.
        weights: how firmly.
        posture: joint angles to stay near where the targets leave freedom [rad].
        pins: joint angles of key frames [rad], NaN where there is none.
    """
    feet = targets.feet
    edges = [
        feet.pos[:, k] + rot.rotate(feet.quat[:, k], np.broadcast_to(point, feet.pos[:, k].shape))
        for k, side in enumerate(FEET)
        for point in (robot.soles[side].heel, robot.soles[side].toe)
    ]
    share = edge_share(feet, targets.fps)
    edge_weight = np.repeat((weights.swing + share * (weights.planted - weights.swing))[..., None], 3, axis=2)
    edge_weight[..., :2][feet.contact == PIVOTING] = weights.pivot
    touching = share.reshape(-1, 2, 2).max(axis=2)
    firmness = np.where(free_joints(robot), weights.free_joint, weights.posture)
    posture_weight = np.broadcast_to(firmness, posture.shape)
    if pins is not None:
        pinned = np.isfinite(pins)
        posture, posture_weight = np.where(pinned, pins, posture), np.where(pinned, weights.pin, posture_weight)
    return Goals(
        weights=weights,
        pelvis_pos=targets.pelvis_pos,
        pelvis_quat=targets.pelvis_quat,
        torso_quat=targets.torso_quat,
        limbs=np.stack([targets.limbs[limb] for limb in LIMBS], axis=1),
        edges=np.stack(edges, axis=1),
        foot_quat=feet.quat,
        posture=posture,
        edge_weight=edge_weight,
        roll_weight=weights.swing_roll + touching * (weights.planted_roll - weights.swing_roll),
        posture_weight=posture_weight,
    )


def _limb_weight(w: GoalWeights) -> Float[ndarray, "L 1"]:
    return np.array([[w.leg if start.endswith(("hip", "knee")) else w.arm] for start, _ in LIMBS])


def _turn(quat: ndarray, wanted: ndarray) -> ndarray:
    """Rotation vector in the world from `wanted` to `quat` [rad]."""
    return rot.log(rot.multiply(quat, rot.conjugate(wanted)))
