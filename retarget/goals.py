"""What the whole-clip solver pulls towards, and the rows of its least-squares problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import PIVOTING
from retarget.config import GoalWeights
from retarget.feet import edge_share
from retarget.free_joints import free_joints
from retarget.targets import Targets
from robot_models import FEET, RobotModel
from robot_models import rotation as rot
from robot_models.jacobians import Kinematics

_X = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class Goals:
    """Wanted poses on T frames, and the weights of those that change in time."""

    weights: GoalWeights
    pelvis_pos: Float[ndarray, "T 3"]
    pelvis_quat: Float[ndarray, "T 4"]
    torso_quat: Float[ndarray, "T 4"]
    limbs: Mapping[tuple[str, str], Float[ndarray, "T 3"]]  # (from, to) -> vector [m]
    edges: Float[ndarray, "T 4 3"]  # heel and toe of the left and the right sole [m]
    foot_quat: Float[ndarray, "T 2 4"]
    posture: Float[ndarray, "T J"]
    edge_weight: Float[ndarray, "T 4 3"]
    roll_weight: Float[ndarray, "T 2"]
    posture_weight: Float[ndarray, "T J"]

    def at(self, frames: Int[ndarray, "F"]) -> Goals:
        """The same goals on some of the frames."""
        picked = {f.name: getattr(self, f.name)[frames] for f in fields(self) if f.name not in ("weights", "limbs")}
        return Goals(weights=self.weights, limbs={k: v[frames] for k, v in self.limbs.items()}, **picked)

    def rows(self, kin: Kinematics) -> tuple[Float[ndarray, "T R"], Float[ndarray, "T R nv"], int]:
        """Weighted residuals, their derivatives, and how many rows are the body's: the feet's come after them."""
        w, robot = self.weights, kin.robot
        out = _Rows(kin)
        out.add(kin.pos[:, 0] - self.pelvis_pos, out.point(0), w.pelvis_position)
        out.add(_turn(kin.quat[:, 0], self.pelvis_quat), kin.turn_jacobian(0), w.pelvis_orientation)
        torso = robot.landmark("torso")
        out.add(_turn(kin.quat[:, torso], self.torso_quat), kin.turn_jacobian(torso), w.torso_orientation)
        for (start, end), vector in self.limbs.items():
            a, b = robot.landmark(start), robot.landmark(end)
            weight = w.leg if start.endswith(("hip", "knee")) else w.arm
            out.add(kin.pos[:, b] - kin.pos[:, a] - vector, out.point(b) - out.point(a), weight)
        body_rows = out.count
        for k, side in enumerate(FEET):
            foot, sole = robot.landmark(f"{side}_foot"), robot.soles[side]
            for j, edge in enumerate((sole.heel, sole.toe), start=2 * k):
                point = kin.pos[:, foot] + rot.rotate(kin.quat[:, foot], np.broadcast_to(edge, (len(kin.pos), 3)))
                out.add(point - self.edges[:, j], kin.point_jacobian(foot, point), self.edge_weight[:, j])
            # Two points leave the foot free to roll about the line through them.
            along = rot.rotate(self.foot_quat[:, k], np.broadcast_to(_X, (len(kin.pos), 3)))
            roll = (_turn(kin.quat[:, foot], self.foot_quat[:, k]) * along).sum(axis=1, keepdims=True)
            out.add(roll, along[:, None] @ kin.turn_jacobian(foot), self.roll_weight[:, k, None])
        return np.concatenate(out.residuals, axis=1), np.concatenate(out.jacobians, axis=1), body_rows


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
        limbs=targets.limbs,
        edges=np.stack(edges, axis=1),
        foot_quat=feet.quat,
        posture=posture,
        edge_weight=edge_weight,
        roll_weight=weights.swing_roll + touching * (weights.planted_roll - weights.swing_roll),
        posture_weight=posture_weight,
    )


class _Rows:
    """Residuals and derivatives, collected."""

    def __init__(self, kin: Kinematics) -> None:
        self._kin = kin
        self._points: dict[int, ndarray] = {}
        self.residuals: list[ndarray] = []
        self.jacobians: list[ndarray] = []

    @property
    def count(self) -> int:
        return sum(r.shape[1] for r in self.residuals)

    def point(self, body: int) -> ndarray:
        """Derivative of a body's origin, made once."""
        if body not in self._points:
            self._points[body] = self._kin.point_jacobian(body, self._kin.pos[:, body])
        return self._points[body]

    def add(self, residual: ndarray, jacobian: ndarray, weight: float | ndarray) -> None:
        self.residuals.append(weight * residual)
        self.jacobians.append((weight if np.ndim(weight) == 0 else np.asarray(weight)[..., None]) * jacobian)


def _turn(quat: ndarray, wanted: ndarray) -> ndarray:
    """Rotation vector in the world from `wanted` to `quat` [rad]."""
    return rot.log(rot.multiply(quat, rot.conjugate(wanted)))
