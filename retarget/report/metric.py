"""`Metric` and `Report`: numbers with units, gates with pass or fail."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from jaxtyping import Float
from numpy import ndarray

from clips import MetricKey
from robot_models.maths import intervals_of


@dataclass(frozen=True, kw_only=True)
class Where:
    """Where a gated number comes from: seconds of the reference, parts of the robot."""

    at_s: float  # the worst of it
    parts: tuple[str, ...] = ()  # bodies, joints or sole edges, as a person calls them
    stretches: tuple[tuple[float, float], ...] = ()  # everything beyond the gate, in order of time
    point_w: tuple[float, float, float] | None = None  # of the worst [m]

    def later(self, seconds: float) -> Where:
        """The same in a reference that begins so much earlier."""
        stretches = tuple((a + seconds, b + seconds) for a, b in self.stretches)
        return replace(self, at_s=self.at_s + seconds, stretches=stretches)


def find_worst(
    values: Float[ndarray, "T"], limit: float, fps: float, parts: Callable[[int], tuple[str, ...]] = lambda _: ()
) -> Where:
    """Where values are largest, and every stretch of frames that has them above a limit.

    Args:
        values: larger is worse, from the first frame of the reference on.
        limit: the gate.
        fps: of the frames.
        parts: of the robot, that a frame is about.
    """
    t = int(values.argmax())
    stretches = tuple((a / fps, (b - 1) / fps) for a, b in intervals_of(values > limit))
    return Where(at_s=t / fps, parts=parts(t), stretches=stretches)


@dataclass(frozen=True, kw_only=True)
class Metric:
    """One measured number; `limit` is its gate, None where it is only told."""

    key: MetricKey
    value: float
    unit: str
    meaning: str
    limit: float | None = None
    where: Where | None = None  # of one with a gate

    @property
    def label(self) -> str:
        """What it is, in words."""
        return self.key.label

    @property
    def passed(self) -> bool:
        """Whether the gate holds; a number without a gate cannot fail."""
        return self.limit is None or self.value <= self.limit

    def as_dict(self) -> dict[str, object]:
        """For the reference's file; of a gate that is missed also the moment."""
        told = {"value": round(self.value, 6), "unit": self.unit, "limit": self.limit, "passed": self.passed}
        if self.passed or self.where is None:
            return told
        return told | {"at_s": round(self.where.at_s, 3), "parts": list(self.where.parts)}

    def worse_than(self, other: Metric) -> bool:
        """Whether it is the worse of two values of one metric."""
        return self.value < other.value if self.key.higher_is_better else self.value > other.value


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Report:
    """All measured numbers, and the curves behind them for the recording."""

    metrics: tuple[Metric, ...]
    series: Mapping[str, Float[ndarray, "T ..."]]
    bounds: Mapping[str, float] = field(default_factory=dict)  # of a curve, beyond which a gate is missed

    def __str__(self) -> str:
        """Every number, a line each, with its gate."""
        gates = (
            "" if m.limit is None else f" (allowed: {m.limit:g}{'' if m.passed else ', missed'})" for m in self.metrics
        )
        return "\n".join(
            f"{m.label}: {m.value:.4g} {m.unit}".rstrip() + g for m, g in zip(self.metrics, gates, strict=True)
        )

    def __repr__(self) -> str:
        missed = ", ".join(m.label for m in self.failures)
        return f"Report({f'missed: {missed}' if missed else 'every gate holds'})"

    def _repr_html_(self) -> str:
        """For notebooks: every number, the missed gates red."""
        rows = "".join(
            f"<tr style='color:{'inherit' if m.passed else 'red'}'><td>{m.label}</td><td>{m.value:.4g} {m.unit}</td>"
            f"<td>{'' if m.limit is None else f'{m.limit:.4g}'}</td></tr>"
            for m in self.metrics
        )
        return f"<table><tr><th>measured</th><th>value</th><th>gate</th></tr>{rows}</table>"

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
        return {str(m.key): m.as_dict() for m in self.metrics}
