"""Where episodes begin: anywhere, at a dance's first frame, or shortly before frames where robots fell of late."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Int
from numpy import ndarray

from robot_models.maths import Array, array_namespace
from tracking.config import StartConfig
from tracking.engines import Rng
from tracking.task.tracking_errors import ReferenceTables


class ResetSampler:
    """Draws start frames, and learns from failures which ones need practice.

    A failure counts for the second before it, because that is where it was brought about. Nothing is binned: a start is
    a remembered failure less a random part of that second. Of several references the harder ones fill the memory.
    """

    def __init__(
        self,
        tables: ReferenceTables,
        dt: float,
        config: StartConfig,
        weights: Sequence[float] = (1.0,),
        to_device: Callable[[ndarray], Array] = np.asarray,
    ) -> None:
        """As the class says.

        Args:
            tables: the references, in main memory.
            dt: control period [s].
            config: how episodes begin.
            weights: of each reference, how often episodes begin in it per frame; 1 or a whole part of it.
            to_device: brings arrays to where the task computes.
        """
        # The last half second is too short to learn anything from.
        latest = np.maximum(tables.first, tables.last - 1 - round(0.5 / dt))
        ends = tables.last[tables.openings]
        anywhere = [np.arange(tables.first[e], latest[e] + 1, round(1 / w)) for e, w in zip(ends, weights, strict=True)]
        self._first, self._openings, self._latest = (
            to_device(tables.first),
            to_device(tables.openings),
            to_device(latest),
        )
        self._anywhere, self._before = to_device(np.concatenate(anywhere)), config.before / dt
        self._shares = np.cumsum((config.opening, config.failed))
        self._remembered = config.remembered
        self.failures: Int[Array, "k"] = to_device(np.empty(0, dtype=int))  # frames of the last ones, the newest last

    def record_failures(self, frames: Int[Array, "n"]) -> None:
        """Remember where robots failed; the oldest failures are forgotten."""
        self.failures = array_namespace(frames).concat((self.failures, frames))[-self._remembered :]

    def draw(self, count: int, rng: Rng) -> Int[Array, "count"]:
        """Start frames of so many episodes."""
        kind = rng.random(count)
        xp = array_namespace(kind)
        start = self._anywhere[rng.integers(0, len(self._anywhere), size=count)]
        if len(self.failures):
            failed = self.failures[rng.integers(0, len(self.failures), size=count)]
            before = xp.asarray(xp.floor(failed - rng.uniform(0.0, self._before, size=count)), dtype=xp.int64)
            before = xp.maximum(before, self._first[failed])
            start = xp.where(kind < self._shares[1], before, start)
        opening = self._openings[rng.integers(0, len(self._openings), size=count)]
        start = xp.where(kind < self._shares[0], opening, start)
        return xp.minimum(start, self._latest[start])
