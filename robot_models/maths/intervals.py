"""Runs: the stretches of frames where something holds, and the way to the nearest."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Int
from numpy import ndarray


def intervals_of(mask: Bool[ndarray, "T"]) -> list[tuple[int, int]]:
    """Half-open frame ranges where the mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(int), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def nearest(mask: Bool[ndarray, "T"]) -> Int[ndarray, "T"]:
    """For every frame the nearest one where the mask, which must be true somewhere, is true; of two the earlier."""
    true, frames = np.flatnonzero(mask), np.arange(len(mask))
    at = np.searchsorted(true, frames)
    before, after = true[np.maximum(at - 1, 0)], true[np.minimum(at, len(true) - 1)]
    return np.where(np.abs(frames - before) <= np.abs(after - frames), before, after)


def away_from(mask: Bool[ndarray, "T"]) -> Int[ndarray, "T"]:
    """How many frames every frame is from the nearest one where the mask, true somewhere, is true."""
    return np.abs(np.arange(len(mask)) - nearest(mask))


def close_gaps(mask: Bool[ndarray, "T"], shortest: int) -> Bool[ndarray, "T"]:
    """The mask with gaps of fewer than `shortest` frames between two true runs filled."""
    out = mask.copy()
    for a, b in intervals_of(~mask):
        if a > 0 and b < len(mask) and b - a < shortest:
            out[a:b] = True
    return out
