"""How fast a body sways over a standing foot: what a file's frame rate has to be, where the file does not say it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.checks.check import Check
from clips.checks.foot_points import foot_points
from clips.clip import Clip, HumanClip
from clips.config import GRAVITY, SWAY
from clips.contact import own_floor
from robot_models.maths import intervals_of, smooth

_G = 9.81  # [m/s2]


_WHAT = "the body sways over a standing foot as gravity has it"


def check_sway(clip: Clip) -> Check:
    """The rate at which the body sways as bodies do, against the clip's: told where another fits and its own does not."""
    least, most = SWAY.at_truth / SWAY.clear, SWAY.at_truth * SWAY.clear
    limit = f"{least:.1f} to {most:.1f}"
    ratio = sway_ratio(clip)
    if ratio is None:
        return Check(what=_WHAT, value="it does not say", limit=limit, verdict="cannot tell")
    value = f"{ratio:.1f} times as fast"
    if least <= ratio <= most:
        return Check(what=_WHAT, value=value, limit=limit, verdict="holds")
    rate = likely_rate({fps: sway_ratio(replace(clip, fps=fps)) for fps in (f * clip.fps for f in SWAY.mistaken)})
    if rate is None:
        return Check(what=_WHAT, value=value, limit=limit, verdict="cannot tell")
    value += f" at {clip.fps:.4g} frames per second; {rate:.4g} would fit"
    return Check(what=_WHAT, value=value, limit=limit, verdict="doubtful", option="fps", suggestion=f"{rate:.4g}")


def sway_ratio(clip: Clip) -> float | None:
    """How many times faster than its frame rate says the body sways; about 0.83 at the true rate, None if it tells nothing.

    Over one standing foot the trunk is a pendulum on its head: its horizontal acceleration is g/h of its distance from the
    pressure under the foot (Kajita & Tani 1991). Both are compared as root mean squares, with the foot's middle for the
    pressure, which is why it is below one. Accelerations grow with the square of the rate, distances do not.
    """
    feet = foot_points(clip)
    points = feet.points
    floor = own_floor(points.reshape(clip.frames, -1, 3)).reshape(points.shape[1:3])
    trunk = feet.pelvis
    if isinstance(clip, HumanClip):
        trunk = 0.5 * trunk + 0.25 * (clip.point("left_shoulder") + clip.point("right_shoulder"))
    way = smooth(trunk[:, :2], clip.fps, SWAY.smooth_hz)
    pull = np.gradient(np.gradient(way, axis=0), axis=0) * clip.fps**2
    upright = feet.pelvis[:, 2] - floor.min() > GRAVITY.upright * feet.leg  # whoever kneels is no pendulum
    if upright.mean() < SWAY.upright:
        return None
    down = (points[..., 2] - floor < SWAY.down).any(axis=2) & upright[:, None]
    off, pulled = list[ndarray](), list[ndarray]()
    for k in (0, 1):
        middle = points[:, k, :, :2].mean(axis=1)
        for a, b in intervals_of(down[:, k] & ~down[:, 1 - k]):
            if b - a >= SWAY.shortest:
                off.append((way - middle)[a:b])
                pulled.append(pull[a:b])
    if sum(map(len, off)) < SWAY.frames:
        return None
    return _ratio(
        np.concatenate(off).ravel(), np.concatenate(pulled).ravel(), float(np.median(trunk[:, 2]) - floor.min())
    )


def _ratio(off: Float[ndarray, "N"], pull: Float[ndarray, "N"], height: float) -> float | None:
    """The square root of distances over accelerations, in units of height over gravity; None where they do not go together."""
    if min(off.std(), pull.std()) < 1e-9 or np.corrcoef(off, pull)[0, 1] < SWAY.together:
        return None
    return float(np.sqrt(off.std() / pull.std() * _G / height))


def likely_rate(ratios: Mapping[float, float | None]) -> float | None:
    """Of rates that were tried, the one at which the body sways as a body does; None where this is not clear.

    Args:
        ratios: `sway_ratio` by rate [frames/s].
    """
    off = {rate: abs(np.log(ratio / SWAY.at_truth)) for rate, ratio in ratios.items() if ratio is not None}
    if not off:
        return None
    best = min(off, key=lambda rate: off[rate])
    return best if off[best] < np.log(SWAY.clear) else None
