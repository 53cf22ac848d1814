"""Runs: the stretches of frames where something holds."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool
from numpy import ndarray


def runs_of(mask: Bool[ndarray, "T"]) -> list[tuple[int, int]]:
    """Half-open frame ranges where the mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(int), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
