"""A zero-phase smoother for whole clips: the curve that stays near the data with small third differences."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])


def smooth(x: Float[ndarray, "T ..."], fps: float, half_power_hz: float) -> Float[ndarray, "T ..."]:
    """Minimise |y - x|^2 + lambda |third differences of y|^2 (Eilers 2003, "A perfect smoother").

    Quadratics pass unchanged and the ends need no padding. lambda is set so that the gain at `half_power_hz` is
    one half: the penalty's spectrum is (2 sin(w/2))^6.
    """
    if len(x) < 4 or half_power_hz <= 0.0 or half_power_hz >= 0.5 * fps:
        return np.array(x)
    from scipy.linalg import solveh_banded

    strength = (2.0 * np.sin(np.pi * half_power_hz / fps)) ** -6
    bands = np.zeros((4, len(x)))  # upper form: the diagonal in the last row
    bands[3] = 1.0
    for i in range(4):
        for j in range(i, 4):
            count = len(x) - 3
            bands[3 - (j - i), j : j + count] += strength * _THIRD[i] * _THIRD[j]
    flat = np.asarray(x).reshape(len(x), -1)
    return np.asarray(solveh_banded(bands, flat)).reshape(np.shape(x))
