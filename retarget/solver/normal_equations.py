"""One Gauss-Newton step as a quadratic problem: its model, and its solution within limits and clearances.

Smoothness is a penalty on third differences, whose strength sets the motion's bandwidth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from retarget.errors import RetargetError
from retarget.solver.collision import Clearance
from retarget.solver.joint_limits import JointLimit
from retarget.solver.objective import Objective
from retarget.solver.physics_rows import PhysicsRows
from robot_models import tangents
from robot_models.maths import HALF_BANDWIDTH, BandedSystem, Memory, difference_transposed


@dataclass(frozen=True, kw_only=True, eq=False)
class NormalEquations:
    """What a step would cost: one block per frame, and third differences between frames."""

    blocks: Float[ndarray, "T nv nv"]
    smoothness: Float[ndarray, "nv"]  # weights of the third differences
    gradient: Float[ndarray, "T nv"]  # at no step


def normal_equations(
    objective: Objective,
    qpos: ndarray,
    residual: ndarray,
    jacobian: ndarray,
    body_rows: int,
    damping: ndarray,
    bandwidths: ndarray,
) -> NormalEquations:
    """The Gauss-Newton model about `qpos`: goals, posture, smoothness and damping.

    Args:
        objective: with posture and its weights.
        qpos: configurations of the frames.
        residual: weighted rows of the goals.
        jacobian: their derivatives.
        body_rows: how many of the rows are the body's, before the feet's.
        damping: per frame, as a share of the goals' curvature.
        bandwidths: half-power frequency of every coordinate's smoothness, as a share of the frame rate.
    """
    blocks, gradient = jacobian.swapaxes(1, 2) @ jacobian, (residual[:, None] @ jacobian)[:, 0]
    # Smoothness is measured against what the body's goals weigh, not the feet's: a planted foot shall not shake it.
    body = jacobian[:, :body_rows]
    curvature = np.median(np.einsum("tri,tri->ti", body, body), axis=0)
    curvature = np.maximum(curvature, np.median(curvature[6:]))
    diagonal = np.einsum("tii->ti", blocks)  # a view
    diagonal += 1e-3 + damping[:, None] * curvature
    diagonal[:, 6:] += objective.posture_weight**2
    gradient[:, 6:] += objective.posture_weight**2 * (qpos[:, 7:] - objective.posture)
    smoothness = (2.0 * np.sin(np.pi * bandwidths)) ** -6 * curvature
    if len(qpos) > HALF_BANDWIDTH:
        gradient += difference_transposed(smoothness * _third_difference(qpos), HALF_BANDWIDTH)
    return NormalEquations(blocks=blocks, smoothness=smoothness, gradient=gradient)


def constrained_step(
    model: NormalEquations,
    joints: ndarray,
    limits: list[JointLimit],
    clearance: Clearance | None,
    rounds: int,
    memory: Memory,
    physics: PhysicsRows | None = None,
) -> ndarray:
    """The step that minimises the model within limits and clearances, by active sets.

    Args:
        model: what the step costs.
        joints: where it begins.
        limits: the joints' limits.
        clearance: of soles and bodies.
        rounds: of the active sets, at most.
        physics: what floor and motors cannot give.
        memory: where the systems may stand, one after the other.

    Raises:
        RetargetError: the model has no minimum.
    """
    smoothness = np.broadcast_to(model.smoothness, (max(0, len(joints) - HALF_BANDWIDTH), len(model.smoothness)))
    for _ in range(rounds):
        blocks, gradient = model.blocks.copy(), model.gradient.copy()
        if clearance is not None:
            clearance.add_to(blocks, gradient)
        if physics is not None:
            physics.add_to(blocks, gradient)
        system = BandedSystem(blocks, memory)
        if physics is not None:
            physics.couple(system)
        system.add_differences(HALF_BANDWIDTH, smoothness)
        for limit in limits:
            limit.add_to(system, gradient, joints)
        try:
            step = -system.solve(gradient)
        except np.linalg.LinAlgError as e:
            raise RetargetError("whole-clip solver", found=str(e), expected="a solvable problem") from e
        changed = sum(b.update(joints + step[:, 6:]) for b in limits)
        changed += 0 if clearance is None else clearance.update(step)
        changed += 0 if physics is None else physics.update(step)
        # Few changes are left to the next iteration, but not a collision: it would be parted there, and come back.
        if changed <= len(joints) // 200 and (clearance is None or not len(clearance.missed)):
            break
    return step


def _third_difference(qpos: ndarray) -> ndarray:
    """Of root position, root rotation (by the log map) and joints."""
    return np.diff(tangents(qpos), 2, axis=0)
