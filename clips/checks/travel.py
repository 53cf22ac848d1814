"""Whether the feet stand still somewhere while the body travels: else the travel is missing, or in another unit."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips.checks.check import Check, Verdict
from clips.checks.foot_points import FootPoints, foot_points
from clips.clip import Clip
from clips.config import TRAVEL
from clips.contact import own_floor

_WHAT = "feet stand while the body travels"


def check_travel(clip: Clip) -> Check:
    """The hips' speed against that of the lowest foot under them.

    While a foot stands, the hips move over it as fast as it moves back under them. Of 54 recordings the hips have 0.44 to 1.2 of
    that speed, of those with a root that is held 0, of those whose root is in another unit the ratio of the units.
    """
    feet = foot_points(clip)
    lowest, height = _lowest_point(feet)
    half = max(1, round(0.5 * TRAVEL.over_s * clip.fps))  # so that a marker's noise is no speed
    hips = _velocity(feet.hips, half, clip.fps)
    points = feet.points.reshape(clip.frames, -1, 3)
    under = _velocity(points - feet.hips[:, None], half, clip.fps)[np.arange(len(hips)), lowest[half:-half]]
    drive = np.linalg.norm(under, axis=1)
    told = (drive > TRAVEL.least_drive) & (height[half:-half] < TRAVEL.near_floor)
    if told.sum() < max(3.0, TRAVEL.least_s * clip.fps):
        return Check(
            what=_WHAT, value=f"they drive the body for {told.sum() / clip.fps:.1f} s only",
            limit=f"{TRAVEL.least_s} s to tell from", verdict="cannot tell",
        )  # fmt: skip
    return _judged(hips[told], under[told], f"in {told.sum() / clip.fps:.1f} s of {clip.frames / clip.fps:.1f} s")


def _judged(hips: Float[ndarray, "N 2"], under: Float[ndarray, "N 2"], where: str) -> Check:
    """The answer from the hips' velocity and that of the foot which stands, seen from the hips [m/s]."""
    drive = np.linalg.norm(under, axis=1)

    def slip(factor: float) -> float:
        return float(np.median(np.linalg.norm(factor * hips + under, axis=1) / drive))

    share, (least, most) = float(np.median(np.linalg.norm(hips, axis=1)) / np.median(drive)), TRAVEL.of_drive
    value = f"the hips move at {share:.2g} of the speed at which the feet drive them; what stands slips by {100 * slip(1):.0f} %"
    if least <= share <= most or slip(1.0) < TRAVEL.most_slip:
        verdict: Verdict = "doubtful" if slip(1.0) > TRAVEL.doubtful_slip else "holds"
        return Check(what=_WHAT, value=value, limit=f"{least:g} to {most:g}", verdict=verdict, where=where)
    best = min(TRAVEL.unit_ratios, key=slip)
    unit = best if slip(best) < TRAVEL.unit_slip else None
    return Check(
        what=_WHAT, value=value, verdict="refused", where=where,
        limit=f"{least:g} to {most:g} of it: the travel is missing, or in another unit",
        cure="let the feet carry the body" if unit is None else "state the factor of the root's positions",
        option="travel" if unit is None else "travel_scale",
        suggestion="from-feet" if unit is None else f"{unit:g}",
    )  # fmt: skip


def _lowest_point(feet: FootPoints) -> tuple[Int[ndarray, "T"], Float[ndarray, "T"]]:
    """Which of the feet's points, in their order, is the lowest over its own floor, and how high it is [m]."""
    points = feet.points.reshape(len(feet.points), -1, 3)
    height = points[..., 2] - own_floor(points)
    return height.argmin(axis=1), height.min(axis=1)


def _velocity(x: Float[ndarray, "T ..."], half: int, fps: float) -> Float[ndarray, "V ..."]:
    """Horizontal velocity over a short while [m/s]; `half` frames are lost at either end."""
    return np.asarray((x[2 * half :] - x[: -2 * half])[..., :2] * (fps / (2.0 * half)))
