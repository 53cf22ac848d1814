"""Rows that couple three frames: what a frame lacks, by the frame before it, itself, and the one after."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from retarget.config import PhysicsConfig
from robot_models.maths import BandedSystem

WRENCH = 6  # rows of the wrench; those of joints follow
_OFFSETS = (-1, 0, 1)


class PhysicsRows:
    """Weighted residuals of F frames with K rows each, their derivatives, and which of them are held."""

    def __init__(
        self,
        *,
        frames: Int[ndarray, "F"],
        residual: Float[ndarray, "F K"],
        by: Float[ndarray, "3 F K nv"],
        outwards: Float[ndarray, "F 6"],
        joints: Int[ndarray, "F _"],
        config: PhysicsConfig,
    ) -> None:
        """Begin with all held.

        Args:
            frames: with rows; none is the first or the last.
            residual: in gates; positive, or along `outwards`, is beyond what can be.
            by: derivatives by the frame before, itself, and the one after.
            outwards: the way out of the cone of each frame; 0 where its wrench has no rows.
            joints: whose torques the later rows are; -1 for none.
            config: weights. What is far beyond counts no more than in proportion (Huber 1964): a frame that is
                impossible is not to bend its neighbours.
        """
        size = np.linalg.norm(residual, axis=1)
        weight = config.weight * np.sqrt(np.minimum(1.0, config.most / np.maximum(size, 1e-9)))
        self.frames, self.outwards, self.joints = frames, outwards, joints
        self._residual, self._by = residual * weight[:, None], by * weight[:, None, None]
        self._on = np.ones_like(residual, dtype=bool)

    @property
    def holds_wrench(self) -> Bool[ndarray, "F"]:
        """Frames whose wrench is held."""
        return self._on[:, 0] & self.outwards.any(axis=1)

    @property
    def holds_joint(self) -> Bool[ndarray, "F _"]:
        """Joints that are held."""
        return self._on[:, WRENCH:] & (self.joints >= 0)

    def squared(self, frames: int, step: Float[ndarray, "T nv"] | None = None) -> Float[ndarray, "T"]:
        """Squared residuals by frame, of so many; after a step those of the rows that it ends on."""
        out = np.zeros(frames)
        value = self._residual if step is None else self._after(step) * self._on
        out[self.frames] = np.square(value).sum(axis=1)
        return out

    def add_to(self, blocks: Float[ndarray, "T nv nv"], gradient: Float[ndarray, "T nv"]) -> None:
        """Add what is within frames to a quadratic model."""
        residual = (self._residual * self._on)[..., None]
        for by, offset in zip(self._by, _OFFSETS, strict=True):
            held = (by * self._on[..., None]).swapaxes(1, 2)
            blocks[self.frames + offset] += held @ by
            gradient[self.frames + offset] += (held @ residual)[..., 0]

    def couple(self, system: BandedSystem) -> None:
        """Add what is between frames to a system."""
        held = self._by * self._on[..., None]
        for early, late in ((0, 1), (1, 2), (0, 2)):
            blocks = held[late].swapaxes(1, 2) @ self._by[early]
            system.add_coupling(self.frames + _OFFSETS[early], late - early, blocks)

    def update(self, step: Float[ndarray, "T nv"]) -> int:
        """Let rows join and leave by what a step would do; in how many frames some did."""
        then = self._after(step)
        on = then >= 0.0  # rows of nothing stay
        on[:, :WRENCH] = ((self.outwards * then[:, :WRENCH]).sum(axis=1) >= 0.0)[:, None]
        changed = int((on != self._on).any(axis=1).sum())
        self._on = on
        return changed

    def _after(self, step: ndarray) -> ndarray:
        moved = (by @ step[self.frames + k][..., None] for by, k in zip(self._by, _OFFSETS, strict=True))
        return np.asarray(self._residual + sum(moved)[..., 0])
