"""A mink task for the direction of a limb: the vector from one body to another, in the world.

Directions are what makes a dance recognisable, and they need no absolute places: where the robot's trunk cannot
follow the person's, the arms still point where they should.
"""

from __future__ import annotations

import mink
import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray


class SegmentTask(mink.Task):  # type: ignore[misc]
    """Bring the vector from the origin of body `start` to a point of body `end` to a given one."""

    k: int = 3

    def __init__(self, start: int, end: int, cost: float, beyond: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        super().__init__(cost=np.full(3, cost), gain=1.0, lm_damping=0.0)
        self._start, self._end, self._beyond = start, end, np.array(beyond)  # the last in the body's frame [m]
        self._target = np.zeros(3)

    def set_target(self, vector_w: Float[ndarray, "3"]) -> None:
        """The wanted vector, of the robot's own length [m]."""
        self._target = np.asarray(vector_w)

    def compute_error(self, configuration: mink.Configuration) -> Float[ndarray, "3"]:
        """Vector minus target, world frame [m]."""
        return np.asarray(self._point(configuration.data) - configuration.data.xpos[self._start] - self._target)

    def compute_jacobian(self, configuration: mink.Configuration) -> Float[ndarray, "3 nv"]:
        """Derivative of the vector by the configuration's tangent: the difference of two point Jacobians."""
        model, data = configuration.model, configuration.data
        end, start = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, end, None, self._point(data), self._end)
        mujoco.mj_jacBody(model, data, start, None, self._start)
        return end - start

    def _point(self, data: mujoco.MjData) -> Float[ndarray, "3"]:
        return np.asarray(data.xpos[self._end] + data.xmat[self._end].reshape(3, 3) @ self._beyond)
