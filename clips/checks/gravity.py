"""Whether flights fall as gravity lets them: a wrong frame rate or unit shows there."""

from __future__ import annotations

import numpy as np

from clips.checks.check import Check, Verdict
from clips.checks.foot_points import foot_points
from clips.clip import Clip, HumanClip
from clips.config import GRAVITY
from clips.contact import own_floor
from robot_models.maths import intervals_of


def check_gravity(clip: Clip) -> Check:
    """Mean vertical acceleration of the trunk while both feet are high over the floor, over all such flights."""
    what, limit = "flights fall", f"{GRAVITY.falls[0]:g} to {GRAVITY.falls[1]:g} m/s2"
    feet = foot_points(clip)
    points = feet.points.reshape(clip.frames, -1, 3)
    floor = own_floor(points)
    upright = feet.pelvis[:, 2] - floor.min() > GRAVITY.upright * feet.leg  # nobody who sits or lies is in flight
    high = ((points[..., 2] - floor).min(axis=1) > GRAVITY.high) & upright
    trunk = feet.pelvis[:, 2]
    if isinstance(clip, HumanClip):
        trunk = 0.5 * trunk + 0.25 * (clip.point("left_shoulder") + clip.point("right_shoulder"))[:, 2]
    flights = [(a, b) for a, b in intervals_of(high) if b - a >= max(4.0, GRAVITY.least_s * clip.fps)]
    if not flights:
        return Check(what=what, value="no flight", limit=limit, verdict="cannot tell")
    # A parabola through each flight: its second derivative, weighted by how well its length tells it.
    fits = [2.0 * np.polyfit(np.arange(b - a) / clip.fps, trunk[a:b], 2)[0] for a, b in flights]
    weights = [float(b - a) ** 2 for a, b in flights]
    falls = -float(np.average(fits, weights=weights))
    verdict: Verdict = "holds" if GRAVITY.falls[0] <= falls <= GRAVITY.falls[1] else "doubtful"
    where = f"{len(flights)} of them, first at {flights[0][0] / clip.fps:.2f} s"
    value = f"at {falls:.1f} m/s2"
    if verdict == "doubtful":
        rate = clip.fps * float(np.sqrt(9.81 / falls)) if falls > GRAVITY.some else 0.0
        value += f"; at {rate:.3g} frames per second it would be 9.8" if rate else ""
    return Check(what=what, value=value, limit=limit, verdict=verdict, where=where)
