"""The mirror image of what a policy observes: which number stands for which on the other side (`robot_models.symmetry`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int
from numpy import ndarray

from robot_models import AXIAL, POLAR, Reflection, RobotModel, other_side, reflected_joints
from tracking.policy import TERMS, Row

SIGNS = {
    "polar": POLAR,
    "planar": POLAR[:2],
    "axial": AXIAL,
    "turns": AXIAL[:2],  # roll and pitch
    "odd": AXIAL[2:],  # yaw, and its rate
    "scalar": np.ones(1),
    "columns": np.array((1.0, -1.0, -1.0, 1.0, 1.0, -1.0)),  # two columns of S R S, row by row, S = diag(1, -1, 1)
    "quat_xyzw": np.array((-1.0, 1.0, -1.0, 1.0)),
}
"""What each kind of number is multiplied by in the mirror; those of joints and bodies change places too."""


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
            return Reflection(order=order, sign=np.tile(POLAR, len(self.bodies)))
        return Reflection(order=np.arange(row.size), sign=SIGNS[kind])


def symmetry_of(robot: RobotModel) -> Symmetry | None:
    """A robot's mirror image; None where its two sides are not alike."""
    joints, tracked = reflected_joints(robot), other_side(robot.profile.tracked)
    return None if joints is None or tracked is None else Symmetry(joints=joints, bodies=tracked)
