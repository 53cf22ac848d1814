"""So many of so many, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Z95 = 1.96


@dataclass(frozen=True, kw_only=True)
class Share:
    """So many of so many, and the 95 % interval of the share (Wilson)."""

    count: int
    of: int

    def __post_init__(self) -> None:
        if not all(type(n) is int for n in (self.count, self.of)) or not 0 <= self.count <= self.of or not self.of:
            raise ValueError(f"{self.count} of {self.of}")

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end."""
        return wilson(self.count, self.of)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{100 * self.count / self.of:.1f} % of {self.of} [{100 * low:.1f}, {100 * high:.1f}]"


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Wilson 1927): right near 0 and 1 too."""
    p, n, z = successes / trials, trials, Z95
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return float(max(0.0, centre - half)), float(min(1.0, centre + half))
