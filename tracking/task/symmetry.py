"""The mirror image of a robot: which joint, body and observed number stands for which on the other side.

Reflected at the plane that the robot's x and z axes span, positions and velocities change the sign of y, turns and angular
velocities the signs of x and z, and left and right change places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models import RobotModel, joint_axes
from tracking.policy import TERMS, Row

_POLAR, _AXIAL = np.array((1.0, -1.0, 1.0)), np.array((-1.0, 1.0, -1.0))
SIGNS = {
    "polar": _POLAR,
    "planar": _POLAR[:2],
    "axial": _AXIAL,
    "turns": _AXIAL[:2],  # roll and pitch
    "odd": _AXIAL[2:],  # yaw, and its rate
    "scalar": np.ones(1),
    "columns": np.array((1.0, -1.0, -1.0, 1.0, 1.0, -1.0)),  # two columns of S R S, row by row, S = diag(1, -1, 1)
    "quat_xyzw": np.array((-1.0, 1.0, -1.0, 1.0)),
}
"""What each kind of number is multiplied by in the mirror; those of joints and bodies change places too."""
_CLOSE = 1e-3  # how far axes and places [m] of the two sides may differ


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflection:
    """What numbers are in the mirror: `sign * numbers[..., order]`."""

    order: Int[ndarray, "K"]
    sign: Float[ndarray, "K"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Symmetry:
    """The mirror image of a robot."""

    joints: Reflection
    bodies: Int[ndarray, "B"]  # which tracked body stands where each does

    def of_rows(self, rows: Sequence[Row]) -> Reflection:
        """The mirror image of what a policy observes."""
        orders, signs, at = [], [], 0
        for row in rows:
            part = self._of_row(row)
            orders.append(at + part.order)
            signs.append(part.sign)
            at += row.size
        return Reflection(order=np.concatenate(orders), sign=np.concatenate(signs))

    def _of_row(self, row: Row) -> Reflection:
        kind = TERMS[row.kind].reflection
        if kind == "joints":
            repeats, j = row.size // len(self.joints.order), len(self.joints.order)
            order = np.concatenate([k * j + self.joints.order for k in range(repeats)])
            return Reflection(order=order, sign=np.tile(self.joints.sign, repeats))
        if kind == "bodies":
            order = (3 * self.bodies[:, None] + np.arange(3)).ravel()
            return Reflection(order=order, sign=np.tile(_POLAR, len(self.bodies)))
        return Reflection(order=np.arange(row.size), sign=SIGNS[kind])


def symmetry_of(robot: RobotModel) -> Symmetry | None:
    """A robot's mirror image; None where its two sides are not alike."""
    pos, _, axes, _ = joint_axes(robot, robot.zero_qpos[None])
    bodies, joints = (_other_side(names) for names in (robot.body_names, robot.joint_names))
    if bodies is None or joints is None:
        return None
    turned = np.einsum("ji,ji->j", axes[0, joints], _AXIAL * axes[0])
    sign, rest = np.sign(turned), robot.default_joint_pos
    differences = (np.abs(turned) - 1.0, pos[0, bodies] - _POLAR * pos[0], sign * rest[joints] - rest)
    tracked = _other_side(robot.profile.tracked)
    if tracked is None or max(np.abs(d).max() for d in differences) > _CLOSE:
        return None
    return Symmetry(joints=Reflection(order=joints, sign=sign), bodies=tracked)


def _other_side(names: Sequence[str]) -> Int[ndarray, "K"] | None:
    """Where each name's counterpart stands; names without a side are their own."""
    swap = {"left": "right", "right": "left"}
    others = ["_".join(swap.get(word, word) for word in name.split("_")) for name in names]
    if not set(others) <= set(names):
        return None
    return np.array([list(names).index(other) for other in others])
