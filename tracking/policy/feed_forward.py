"""What the robot is asked for before a policy has learned anything: the reference, with the torques that it needs."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference


@runtime_checkable
class Servos(Protocol):
    """What joint targets depend on: a robot's, or a contract's."""

    @property
    def kp(self) -> Float[ndarray, "J"]:
        """[N m/rad]."""

    @property
    def kd(self) -> Float[ndarray, "J"]:
        """[N m s/rad]."""

    @property
    def effort(self) -> Float[ndarray, "J"]:
        """[N m]."""


def joint_targets(reference: Reference, servos: Servos) -> Float[ndarray, "T J"]:
    """Servo targets [rad] for the control period that ends at each frame.

    A servo gives kp (target - q) - kd qdot. On the reference that shall be the torque tau of its inverse dynamics, so
    target = q + (tau + kd qdot) / kp, all of them in the middle of the period. With soft gains that is far from q, and
    may lie beyond the joint's range. Where the reference has no torques tau is taken as zero.

    Args:
        reference: the motion, with `joint_torque` where Pinocchio was at hand when it was made.
        servos: gains and efforts, in the reference's joint order.
    """
    effort = np.zeros_like(reference.joint_pos) if reference.joint_torque is None else reference.joint_torque
    q, qdot, tau = (_middle(x) for x in (reference.joint_pos, reference.joint_vel, effort))
    return q + (np.clip(tau, -servos.effort, servos.effort) + servos.kd * qdot) / servos.kp


def target_range(servos: Servos, lower: Float[ndarray, "J"], upper: Float[ndarray, "J"]) -> tuple[ndarray, ndarray]:
    """How far beyond the joint limits [rad] a target may lie: where a motor pushes with all it has."""
    reach = servos.effort / servos.kp
    return lower - reach, upper + reach


def _middle(x: Float[ndarray, "T J"]) -> Float[ndarray, "T J"]:
    """Mean of each frame and the one before."""
    return np.asarray(0.5 * (x + np.concatenate((x[:1], x[:-1]))), dtype=float)
