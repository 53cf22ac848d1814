"""Where episodes begin: anywhere, at a dance's first frame, or shortly before frames where robots fell of late."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models.maths import Array, array_namespace
from tracking.config import StartConfig
from tracking.engines import Rng
from tracking.task.tracking_errors import ReferenceTables

_PER_REFERENCE = 50  # failures remembered, at least
_FADE = 0.999  # per control step, of the memory of where robots have been


class ResetSampler:
    """Draws start frames, and learns from failures which ones need practice.

    A failure counts for the second before it, because that is where it was brought about. Nothing is binned: a start is
    a remembered failure less a random part of that second. Of several references those in which robots fail more often
    per step are practised more, within `StartConfig.favour` of their share by length.
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
        lengths = tables.last[tables.openings] - tables.first[tables.openings] + 1
        self._which = to_device(np.repeat(np.arange(len(lengths)), lengths))  # reference of every frame
        self._lengths, self._favour = to_device(lengths.astype(float)), config.favour
        self._remembered = max(config.remembered, _PER_REFERENCE * len(lengths))
        self.visits: Float[Array, "R"] = to_device(np.zeros(len(lengths)))  # steps taken in each reference of late
        self.failures: Int[Array, "k"] = to_device(np.empty(0, dtype=int))  # frames of the last ones, the newest last

    def record(self, frames: Int[Array, "N"], failed: Int[Array, "n"]) -> None:
        """Remember where robots are, and where some failed; the oldest failures are forgotten."""
        xp = array_namespace(frames)
        self.failures = xp.concat((self.failures, failed))[-self._remembered :]
        if len(self._lengths) > 1:
            steps = xp.bincount(self._which[frames], minlength=len(self._lengths))
            self.visits = _FADE * self.visits + (1.0 - _FADE) * steps

    def draw(self, count: int, rng: Rng) -> Int[Array, "count"]:
        """Start frames of so many episodes."""
        kind = rng.random(count)
        xp = array_namespace(kind)
        start = self._anywhere[rng.integers(0, len(self._anywhere), size=count)]
        if len(self.failures):
            failed = self.failures[self._practised(rng.random(count))]
            before = xp.asarray(xp.floor(failed - rng.uniform(0.0, self._before, size=count)), dtype=xp.int64)
            before = xp.maximum(before, self._first[failed])
            start = xp.where(kind < self._shares[1], before, start)
        opening = self._openings[rng.integers(0, len(self._openings), size=count)]
        start = xp.where(kind < self._shares[0], opening, start)
        return xp.minimum(start, self._latest[start])

    def state_dict(self) -> dict[str, Array]:
        """What it remembers."""
        return {"failures": self.failures, "visits": self.visits}

    def load_state_dict(self, state: dict[str, Array]) -> None:
        """Remember what was saved."""
        self.failures, self.visits = state["failures"], state["visits"]

    def _practised(self, drawn: Float[Array, "n"]) -> Int[Array, "n"]:
        """Which remembered failures to practise, by numbers drawn from [0, 1)."""
        xp = array_namespace(drawn)
        if len(self._lengths) == 1:
            return xp.asarray(drawn * len(self.failures), dtype=xp.int64)
        reference = self._which[self.failures]
        count = xp.bincount(reference, minlength=len(self._lengths))
        rate = count / xp.clip(self.visits, 1e-3, None)
        rate = rate / xp.clip((rate * self._lengths).sum() / self._lengths.sum(), 1e-9, None)
        share = self._lengths * xp.clip(rate, *self._favour) / xp.clip(count, 1, None)
        summed = xp.cumsum(share[reference], 0)
        return xp.clip(xp.searchsorted(summed, drawn * summed[-1]), 0, len(self.failures) - 1)


class FocusedSampler:
    """Begins a share of the episodes in the first references, and the rest in any; each part learns from its failures."""

    def __init__(
        self,
        tables: ReferenceTables,
        dt: float,
        config: StartConfig,
        first: int,
        to_device: Callable[[ndarray], Array] = np.asarray,
    ) -> None:
        """As the class says.

        Args:
            tables: the references, in main memory.
            dt: control period [s].
            config: how episodes begin; `focus` is the share.
            first: how many references are in focus.
            to_device: brings arrays to where the task computes.
        """
        count = len(tables.openings)
        self._all = ResetSampler(tables, dt, config, [1.0] * count, to_device)
        ours = tables.only(first)
        self._focused, self._frames = ResetSampler(ours, dt, config, [1.0] * first, to_device), len(ours.first)
        self._share = config.focus

    def record(self, frames: Int[Array, "N"], failed: Int[Array, "n"]) -> None:
        """Remember where robots are, and where some failed."""
        self._all.record(frames, failed)
        self._focused.record(frames[frames < self._frames], failed[failed < self._frames])

    def draw(self, count: int, rng: Rng) -> Int[Array, "count"]:
        """Start frames of so many episodes."""
        focused, anywhere = self._focused.draw(count, rng), self._all.draw(count, rng)
        return array_namespace(focused).where(rng.random(count) < self._share, focused, anywhere)

    def state_dict(self) -> dict[str, Array]:
        """What it remembers."""
        return self._all.state_dict() | {f"focused {k}": v for k, v in self._focused.state_dict().items()}

    def load_state_dict(self, state: dict[str, Array]) -> None:
        """Remember what was saved."""
        self._all.load_state_dict(state)
        self._focused.load_state_dict(
            {k.removeprefix("focused "): v for k, v in state.items() if k.startswith("focused ")}
        )
