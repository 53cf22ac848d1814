"""Where episodes begin: anywhere, at the dance's first frame, or shortly before frames where robots fell of late."""

from __future__ import annotations

import numpy as np
from jaxtyping import Int
from numpy import ndarray

from tracking.config import StartConfig


class Starts:
    """Draws start frames, and learns from failures which ones need practice.

    A failure counts for the second before it, because that is where it was brought about. Nothing is binned: a start is
    a remembered failure less a random part of that second.
    """

    def __init__(self, frames: int, opening: int, dt: float, config: StartConfig) -> None:
        # The last half second is too short to learn anything from.
        self._latest = max(1, frames - 1 - round(0.5 / dt))
        self._opening, self._before = opening, config.before / dt
        self._shares = np.cumsum((config.opening, config.failed))
        self._remembered = config.remembered
        self.failures: Int[ndarray, "k"] = np.empty(0, dtype=int)  # frames of the last ones, the newest last

    def fell(self, frames: Int[ndarray, "n"]) -> None:
        """Remember where robots failed; the oldest failures are forgotten."""
        self.failures = np.concatenate((self.failures, frames))[-self._remembered :]

    def draw(self, count: int, rng: np.random.Generator) -> Int[ndarray, "count"]:
        """Start frames of so many episodes."""
        kind = rng.random(count)
        start = rng.integers(0, self._latest, size=count)
        if len(self.failures):
            practice = rng.choice(self.failures, size=count) - rng.uniform(0.0, self._before, size=count)
            start = np.where(kind < self._shares[1], practice.astype(int), start)
        start = np.where(kind < self._shares[0], self._opening, start)
        return np.clip(start, 0, self._latest - 1)
