"""`Metric` and `Report`: numbers with units, gates with pass or fail."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from jaxtyping import Float
from numpy import ndarray

from clips import MetricKey


@dataclass(frozen=True, kw_only=True)
class Metric:
    """One measured number; `limit` is its gate, None where it is only told."""

    key: MetricKey
    value: float
    unit: str
    meaning: str
    limit: float | None = None

    @property
    def label(self) -> str:
        """What it is, in words."""
        return self.key.label

    @property
    def passed(self) -> bool:
        """Whether the gate holds; a number without a gate cannot fail."""
        return self.limit is None or self.value <= self.limit

    def worse_than(self, other: Metric) -> bool:
        """Whether it is the worse of two values of one metric."""
        return self.value < other.value if self.key.higher_is_better else self.value > other.value


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """All measured numbers, and the curves behind them for the recording."""

    metrics: tuple[Metric, ...]
    series: Mapping[str, Float[ndarray, "T ..."]]

    def __getitem__(self, key: MetricKey) -> Metric:
        """The metric of a key.

        Raises:
            KeyError: it was not measured, as physics without Pinocchio.
        """
        return {m.key: m for m in self.metrics}[key]

    @property
    def passed(self) -> bool:
        """Whether every gate holds."""
        return all(m.passed for m in self.metrics)

    @property
    def failures(self) -> tuple[Metric, ...]:
        """The gates that do not hold."""
        return tuple(m for m in self.metrics if not m.passed)

    def as_dict(self) -> dict[str, object]:
        """Numbers for the reference's meta entry."""
        return {
            str(m.key): {"value": round(m.value, 6), "unit": m.unit, "limit": m.limit, "passed": m.passed}
            for m in self.metrics
        }
