"""What the sensors of robots tell: all that a policy knows of the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """What the sensors of N robots tell."""

    quat: Float[ndarray, "N 4"]  # of the root body, from its IMU, wxyz, heading arbitrary
    gyro: Float[ndarray, "N 3"]  # root body [rad/s]
    joint_pos: Float[ndarray, "N J"]  # encoders [rad]
    joint_vel: Float[ndarray, "N J"]  # [rad/s]
    # What no sensor tells. A simulation knows it, a robot only with a state estimator; policies of our own never ask.
    root_pos: Float[ndarray, "N 3"] | None = None  # world [m]
    root_lin_vel: Float[ndarray, "N 3"] | None = None  # root body [m/s]

    def picked(self, order: ndarray) -> Measurement:
        """The same with joints in another order, or some of them."""
        return replace(self, joint_pos=self.joint_pos[:, order], joint_vel=self.joint_vel[:, order])

    def of(self, ids: ndarray) -> Measurement:
        """What the sensors of some of the robots tell."""
        return self._each(lambda value: value[ids])

    def copy(self) -> Measurement:
        """The same numbers in memory of their own."""
        return self._each(np.array)

    def _each(self, of: Callable[[ndarray], ndarray]) -> Measurement:
        told: dict[str, Any] = {name: None if value is None else of(value) for name, value in vars(self).items()}
        return Measurement(**told)

    def put(self, ids: ndarray, other: Measurement) -> None:
        """Overwrite what the sensors of some of the robots tell, in place."""
        for name, value in vars(self).items():
            if value is not None:
                value[ids] = getattr(other, name)
