"""What goes over a robot's wires: the state that it tells, the command that it is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """What one robot's wires tell at one instant, joints in the robot's order."""

    quat: Float[ndarray, "4"]  # IMU, wxyz
    gyro: Float[ndarray, "3"]  # [rad/s]
    joint_pos: Float[ndarray, "J"]  # [rad]
    joint_vel: Float[ndarray, "J"]  # [rad/s]
    received: float  # when a state that differs from the one before was first seen, monotonic clock [s]
    # Of the motors, and beside them; None where a robot does not tell.
    torque: Float[ndarray, "J"] | None = None  # the motors' own estimate [N m]
    temperature: Float[ndarray, "J"] | None = None  # [deg C]
    voltage: Float[ndarray, "J"] | None = None  # of the supply, as each motor sees it [V]
    buttons: int = 0  # pressed on the remote, one bit each
    rate: float | None = None  # states that came in during the last second [Hz]


@dataclass(frozen=True, kw_only=True, eq=False)
class Command:
    """What one robot's wires are told: servo targets and gains; damping where kp is zero."""

    target: Float[ndarray, "J"]  # [rad]
    kp: Float[ndarray, "J"]  # [N m/rad]
    kd: Float[ndarray, "J"]  # [N m s/rad]

    @property
    def finite(self) -> bool:
        """Whether every number is one."""
        return bool(np.isfinite(np.concatenate((self.target, self.kp, self.kd))).all())
