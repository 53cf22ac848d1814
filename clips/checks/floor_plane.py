"""The plane that feet stand on: how far the world of a recording leans, as a camera's frame does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.checks.check import Check, Verdict
from clips.checks.foot_points import FootPoints, foot_points
from clips.clip import Clip
from clips.config import LEAN
from robot_models.maths import intervals_of

_ANYWHERE = 1e3  # metres: no prior of a height, so that one without stands has some value


@dataclass(frozen=True, kw_only=True, eq=False)
class FloorPlane:
    """The floor z = a + s . (x, y) under a recording."""

    slope: Float[ndarray, "2"]  # s, rise per metre along x and y
    deviation: float  # of the slope along its own direction, one standard deviation
    standing: float  # share of all stands that are within 3 cm of it
    stands: int

    @property
    def lean_deg(self) -> float:
        """Angle between its normal and the vertical."""
        return float(np.degrees(np.arctan(np.hypot(*self.slope))))

    @property
    def direction_deg(self) -> float:
        """Towards which it rises, from x to y."""
        return float(np.degrees(np.arctan2(self.slope[1], self.slope[0])))

    @property
    def certain(self) -> bool:
        """Whether most stands agree on it, and leave no doubt that it leans at all."""
        deviations = float(np.hypot(*self.slope)) / self.deviation
        return any(self.standing >= share and deviations > least for share, least in LEAN.certain)


def check_floor(clip: Clip) -> Check:
    """Whether the floor that feet stand on is level; asked after what leans beyond doubt was turned upright."""
    what, limit = "the floor is level", f"at most {LEAN.least_deg:g} deg"
    plane = fit_floor(foot_points(clip), clip.fps)
    if plane is None:
        return Check(
            what=what,
            value="feet hardly stand still",
            limit=f"{LEAN.least_stands} stands to tell from",
            verdict="cannot tell",
        )
    unsure = np.degrees(np.arctan(plane.deviation))
    value = f"it leans by {plane.lean_deg:.1f} deg (give or take {unsure:.1f}); {100 * plane.standing:.0f} % of stands agree"
    verdict: Verdict = "holds" if plane.lean_deg <= LEAN.least_deg else "doubtful" if plane.certain else "cannot tell"
    return Check(what=what, value=value, limit=limit, verdict=verdict, where=f"{plane.stands} stands")


def fit_floor(feet: FootPoints, fps: float) -> FloorPlane | None:
    """The plane of all stands, robustly; None where feet hardly ever stand still.

    Unknown are the slope and the height of each point of the feet over its sole. A stand is a point that stays slow, however
    long. Nothing stands under the floor, but feet also stand still in the air, so what lies over the plane counts less
    the higher it is. Where stands tell little, as on a straight way about the lateral axis, the body does, weakly: its left is
    level and its up is vertical on the mean.
    """
    place, height, point, weight = _stands(feet, fps)
    if len(height) < LEAN.least_stands:
        return None
    count = feet.points.shape[1] * feet.points.shape[2]
    rows = np.concatenate((np.eye(count)[point], place - place.mean(axis=0)), axis=1)
    priors, wanted = _priors(feet, count)
    slope_part = slice(count, count + 2)
    weights = weight
    for scale in LEAN.scales:
        weighted = rows * (weights / LEAN.noise)[:, None]
        normal = weighted.T @ weighted + priors.T @ priors
        plane = np.linalg.solve(normal, weighted.T @ (height * weights / LEAN.noise) + priors.T @ wanted)
        over = height - rows @ plane
        weights = weight / np.where(over > 0.0, 1.0 + (over / scale) ** 2, 1.0)
    slope, covariance = plane[slope_part], np.linalg.inv(normal)[slope_part, slope_part]
    along = slope / max(float(np.hypot(*slope)), 1e-9)
    return FloorPlane(
        slope=slope,
        deviation=float(np.sqrt(along @ covariance @ along)),
        standing=float(np.average(np.abs(over) < LEAN.agreement, weights=weight)),
        stands=len(height),
    )


def _stands(
    feet: FootPoints, fps: float
) -> tuple[Float[ndarray, "N 2"], Float[ndarray, "N"], ndarray, Float[ndarray, "N"]]:
    """Place [m], height [m], point and weight of every time that a point stays slow."""
    points = feet.points.reshape(len(feet.points), -1, 3)
    half = max(1, round(0.5 * LEAN.over_s * fps))
    speed = np.linalg.norm(points[2 * half :] - points[: -2 * half], axis=-1) * fps / (2.0 * half)
    longest, shortest = max(1, round(LEAN.longest_s * fps)), max(1.0, LEAN.over_s * fps)
    found = [
        (*np.median(points[half + a : half + b, k], axis=0), k, np.sqrt(min(1.0, (b - a) / longest)))
        for k in range(points.shape[1])
        for a, b in intervals_of(speed[:, k] < LEAN.slow)
        if b - a >= shortest
    ]
    table = np.array(found).reshape(-1, 5)
    return table[:, :2], table[:, 2], table[:, 3].astype(int), table[:, 4]


def _priors(feet: FootPoints, count: int) -> tuple[Float[ndarray, "P C"], Float[ndarray, "P"]]:
    """Weighted rows and values of what is known beside the stands: both feet are alike, the body stands upright."""
    kinds = feet.points.shape[2]
    rows, wanted = [], []

    def add(row: dict[int, float], value: float, deviation: float) -> None:
        rows.append(np.array([row.get(c, 0.0) for c in range(count + 2)]) / deviation)
        wanted.append(value / deviation)

    for kind in range(kinds):
        add({kind: 1.0, kinds + kind: -1.0}, 0.0, LEAN.feet_differ)
        add({kind: 1.0}, 0.0, _ANYWHERE)
    for part in np.array_split(feet.left, min(LEAN.parts, len(feet.left))):
        left = part.mean(axis=0)
        left /= max(float(np.linalg.norm(left)), 1e-9)
        add({count: left[0], count + 1: left[1]}, left[2], LEAN.left_leans)
    up = feet.up.mean(axis=0)
    for axis in (0, 1):
        add({count + axis: 1.0}, -up[axis] / max(up[2], 0.1), LEAN.up_leans)
    return np.array(rows), np.array(wanted)
