"""One Gauss-Newton step as a quadratic problem: its model, and its solution within limits and clearances.

Smoothness is a penalty on third differences, whose strength sets the motion's bandwidth.
"""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from retarget.band import BandedSystem, spread_back
from retarget.bounds import Bound
from retarget.clearance import Clearance
from retarget.errors import RetargetError
from retarget.goals import Goals
from robot_models import rotation as rot


def quadratic_model(
    goals: Goals,
    qpos: ndarray,
    residual: ndarray,
    jacobian: ndarray,
    body_rows: int,
    damping: ndarray,
    bandwidths: ndarray,
) -> tuple[BandedSystem, ndarray]:
    """The Gauss-Newton model about `qpos`: goals, posture, smoothness and damping.

    Args:
        goals: with posture and its weights.
        qpos: configurations of the frames.
        residual: weighted rows of the goals.
        jacobian: their derivatives.
        body_rows: how many of the rows are the body's, before the feet's.
        damping: per frame, as a share of the goals' curvature.
        bandwidths: half-power frequency of every coordinate's smoothness, as a share of the frame rate.

    Returns:
        The system of the step, and the gradient at none.
    """
    hessian, gradient = jacobian.swapaxes(1, 2) @ jacobian, (residual[:, None] @ jacobian)[:, 0]
    joints = range(6, hessian.shape[1])
    hessian[:, joints, joints] += goals.posture_weight**2
    gradient[:, 6:] += goals.posture_weight**2 * (qpos[:, 7:] - goals.posture)
    # Smoothness is measured against what the body's goals weigh, not the feet's: a planted foot shall not shake it.
    body = jacobian[:, :body_rows]
    curvature = np.median(np.einsum("tri,tri->ti", body, body), axis=0)
    curvature = np.maximum(curvature, np.median(curvature[6:]))
    system = BandedSystem(hessian)
    system.add_diagonal(1e-3 + damping[:, None] * curvature)
    if len(qpos) > 3:
        smoothness = (2.0 * np.sin(np.pi * bandwidths)) ** -6 * curvature
        system.add_differences(3, np.broadcast_to(smoothness, (len(qpos) - 3, len(smoothness))))
        gradient += spread_back(smoothness * _third_difference(qpos), 3)
    return system, gradient


def constrained_step(
    system: BandedSystem,
    gradient: ndarray,
    joints: ndarray,
    bounds: list[Bound],
    clearances: list[Clearance],
    rounds: int,
) -> ndarray:
    """The step that minimises the model within limits and clearances, by active sets.

    Raises:
        RetargetError: the model has no minimum.
    """
    held = None
    for _ in range(rounds):
        held, pull = system.copy(held), gradient.copy()
        for bound in bounds:
            bound.add_to(held, pull, joints)
        for clearance in clearances:
            clearance.add_to(held, pull)
        try:
            step = -held.solve(pull)
        except np.linalg.LinAlgError as e:
            raise RetargetError("whole-clip solver", found=str(e), expected="a solvable problem") from e
        changed = sum(b.update(joints + step[:, 6:]) for b in bounds) + sum(c.update(step) for c in clearances)
        if changed <= len(gradient) // 200:  # the rest is left to the next iteration
            break
    return step


def _third_difference(qpos: ndarray) -> ndarray:
    """Of root position, root rotation (by the log map) and joints."""
    first = np.diff(np.concatenate((qpos[:, :3], qpos[:, 4:7], qpos[:, 7:]), axis=1), axis=0)
    first[:, 3:6] = rot.log(rot.multiply(qpos[1:, 3:7], rot.conjugate(qpos[:-1, 3:7])))
    return np.diff(first, 2, axis=0)
