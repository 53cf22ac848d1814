"""Whether the feet stand still somewhere while the body travels: else the travel is missing, or in another unit."""

from __future__ import annotations

from dataclasses import replace

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
    """The pelvis' speed against that of the lowest foot under it.

    While a foot stands, the pelvis moves over it as fast as it moves back under the pelvis. Of 60 recordings the pelvis has
    0.44 to 1.2 of that speed, with a root that is held 0, with a root in another unit the ratio of the units.
    """
    feet = foot_points(clip)
    lowest, height = _lowest_point(feet)
    half = max(1, round(0.5 * TRAVEL.over_s * clip.fps))  # so that a marker's noise is no speed
    pelvis = _velocity(feet.pelvis, half, clip.fps)
    points = feet.points.reshape(clip.frames, -1, 3)
    under = _velocity(points - feet.pelvis[:, None], half, clip.fps)[np.arange(len(pelvis)), lowest[half:-half]]
    drive = np.linalg.norm(under, axis=1)
    told = (drive > TRAVEL.least_drive) & (height[half:-half] < TRAVEL.near_floor)
    if told.sum() < max(3.0, TRAVEL.least_s * clip.fps):
        return Check(
            what=_WHAT, value=f"they drive the body for {told.sum() / clip.fps:.1f} s only",
            limit=f"{TRAVEL.least_s} s to tell from", verdict="cannot tell",
        )  # fmt: skip
    seconds = float(told.sum()) / clip.fps
    least = TRAVEL.of_drive[0] if seconds >= TRAVEL.long_s else TRAVEL.least_of_drive
    check = _judged(pelvis[told], under[told], least, f"in {seconds:.1f} s of {clip.frames / clip.fps:.1f} s")
    stated = clip.source.stated("travel")  # who dances on the spot on sliding feet says --travel-scale 1
    return replace(check, verdict="doubtful", cure="") if stated and check.verdict == "refused" else check


def _judged(pelvis: Float[ndarray, "N 2"], under: Float[ndarray, "N 2"], least: float, where: str) -> Check:
    """The answer from the pelvis' velocity and that of the foot which stands, seen from the pelvis [m/s]."""
    drive = np.linalg.norm(under, axis=1)

    def slip(factor: float) -> float:
        return float(np.median(np.linalg.norm(factor * pelvis + under, axis=1) / drive))

    share, most = float(np.median(np.linalg.norm(pelvis, axis=1)) / np.median(drive)), TRAVEL.of_drive[1]
    value = f"the pelvis moves at {share:.2g} of the speed at which feet drive it; what stands slips by {100 * slip(1):.0f} %"
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
