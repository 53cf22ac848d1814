"""Symmetric systems that are banded in time: dense within a frame, coupled to the three frames after it.

Smoothness and limits couple equal coordinates of frames up to three apart, forces all coordinates of frames up to two
apart, so the band is 3 nv wide and one Cholesky factorisation costs time linear in the frames.
"""

from __future__ import annotations

from math import comb

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray
from numpy.lib.stride_tricks import as_strided

HALF_BANDWIDTH = 3  # frames that one frame is coupled to

Memory = Float[ndarray, "_ nv width"]


class BandedSystem:
    """A x = b for x of shape (T, nv): built up term by term, then factorised, then solved."""

    def __init__(self, blocks: Float[ndarray, "T nv nv"], memory: Memory | None = None) -> None:
        """Begin with one symmetric block per frame; `memory` of as many frames or more is written over."""
        frames, nv, _ = blocks.shape
        # [t, j, d] = A[t nv + j + d, t nv + j]
        self._band = band_memory(frames, nv) if memory is None else memory[:frames]
        self._band[:] = 0.0
        for j in range(nv):
            self._band[:, j, : nv - j] = blocks[:, j, j:]

    def add_differences(self, order: int, weight: Float[ndarray, "Td n"], first: int = 0) -> None:
        """Add weight (order-th time difference of x)^2 / 2 for the n coordinates from `first` on, Td = T - order."""
        nv, count = self._band.shape[1], len(weight)
        c = _coefficients(order)
        part = slice(first, first + weight.shape[1])
        for i in range(order + 1):
            for j in range(i, order + 1):
                self._band[i : i + count, part, (j - i) * nv] += c[i] * c[j] * weight

    def add_coupling(self, frames: Int[ndarray, "F"], ahead: int, blocks: Float[ndarray, "F nv nv"]) -> None:
        """Add to the blocks of frames t + ahead (rows) by t (columns), for every t in `frames`, which has each once."""
        nv, (frame, column, row) = self._band.shape[1], self._band.strides
        later = as_strided(self._band[:, :, ahead * nv :], (len(self._band), nv, nv), (frame, column - row, row))
        later[frames] += blocks.swapaxes(1, 2)

    def solve(self, b: Float[ndarray, "T nv"]) -> Float[ndarray, "T nv"]:
        """x of A x = b; the system is spent afterwards.

        Raises:
            LinAlgError: the system is not positive definite.
        """
        from scipy.linalg import lapack

        frames, nv, width = self._band.shape
        # The transpose is LAPACK's lower form in its own memory order: nothing is copied.
        factor, info = lapack.dpbtrf(self._band.reshape(frames * nv, width).T, lower=1, overwrite_ab=1)
        if info:
            raise np.linalg.LinAlgError(f"not positive definite at frame {info // nv}")
        x, _ = lapack.dpbtrs(factor, b.reshape(-1), lower=1)
        return np.asarray(x).reshape(b.shape)


def band_memory(frames: int, nv: int) -> Memory:
    """Room for one system after another: the first touch of new pages costs more than filling them."""
    return np.empty((frames, nv, HALF_BANDWIDTH * nv + 1))


def difference_transposed(y: Float[ndarray, "Td n"], order: int) -> Float[ndarray, "T n"]:
    """The transpose of the order-th time difference: from differences back to frames."""
    out = np.zeros((len(y) + order, y.shape[1]))
    for k, c in enumerate(_coefficients(order)):
        out[k : k + len(y)] += c * y
    return out


def _coefficients(order: int) -> ndarray:
    """Of the order-th forward difference: 1; -1 1; 1 -2 1; -1 3 -3 1."""
    return np.array([(-1.0) ** (order - k) * comb(order, k) for k in range(order + 1)])


def dilate(mask: Bool[ndarray, "T"], reach: int) -> Bool[ndarray, "T"]:
    """The mask with `reach` frames more on both sides of every true one."""
    return np.convolve(mask, np.ones(2 * reach + 1))[reach : reach + len(mask)] > 0.5
