"""Where episodes begin: anywhere, at a dance's first frame, or shortly before frames where robots fell of late."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int
from numpy import ndarray

from tracking.comparison import ReferenceTables
from tracking.config import StartConfig


class Starts:
    """Draws start frames, and learns from failures which ones need practice.

    A failure counts for the second before it, because that is where it was brought about. Nothing is binned: a start is
    a remembered failure less a random part of that second. Of several references the harder ones fill the memory.
    """

    def __init__(
        self, tables: ReferenceTables, dt: float, config: StartConfig, weights: Sequence[float] = (1.0,)
    ) -> None:
        """Weights: of each reference, how often episodes begin in it per frame; 1 or a whole part of it."""
        self._first, self._openings, self._before = tables.first, tables.openings, config.before / dt
        # The last half second is too short to learn anything from.
        self._latest = np.maximum(tables.first, tables.last - 1 - round(0.5 / dt))
        ends = tables.last[tables.openings]
        self._anywhere = np.concatenate(
            [np.arange(self._first[e], self._latest[e] + 1, round(1 / w)) for e, w in zip(ends, weights, strict=True)]
        )
        self._shares = np.cumsum((config.opening, config.failed))
        self._remembered = config.remembered
        self.failures: Int[ndarray, "k"] = np.empty(0, dtype=int)  # frames of the last ones, the newest last

    def fell(self, frames: Int[ndarray, "n"]) -> None:
        """Remember where robots failed; the oldest failures are forgotten."""
        self.failures = np.concatenate((self.failures, frames))[-self._remembered :]

    def draw(self, count: int, rng: np.random.Generator) -> Int[ndarray, "count"]:
        """Start frames of so many episodes."""
        kind = rng.random(count)
        start = self._anywhere[rng.integers(0, len(self._anywhere), size=count)]
        if len(self.failures):
            failed = rng.choice(self.failures, size=count)
            before = np.maximum((failed - rng.uniform(0.0, self._before, size=count)).astype(int), self._first[failed])
            start = np.where(kind < self._shares[1], before, start)
        opening = self._openings[rng.integers(0, len(self._openings), size=count)]
        start = np.where(kind < self._shares[0], opening, start)
        return np.minimum(start, self._latest[start])
