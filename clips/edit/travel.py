"""Travel that a recording lost: the body carried by the foot that stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.checks import foot_points
from clips.clip import Clip, HumanClip
from clips.config import TRAVEL
from clips.contact import own_floor


def travel_from_feet(clip: Clip) -> Clip:
    """The same motion, its way over the floor made anew: from frame to frame the lowest point of the feet stays where it is.

    While both feet are in the air the body keeps its velocity. On recordings whose way is known it is some 4 % of that way off.
    Where the hips' height is missing too, the lowest point stands on the floor in every frame, and jumps are lost.
    """
    points = foot_points(clip).points.reshape(clip.frames, -1, 3)
    shift = np.zeros((clip.frames, 3))
    if np.ptp(_root(clip)[:, 2]) < TRAVEL.held_height:
        lowest = points[..., 2].min(axis=1)
        shift[:, 2] = np.median(lowest) - lowest
        points = points + shift[:, None]
    height = points[..., 2] - own_floor(points)
    frames, stands = np.arange(clip.frames - 1), (height[1:] + height[:-1]).argmin(axis=1)
    step = points[frames, stands] - points[frames + 1, stands]  # of the body, for that point to stay
    flying = height[frames, stands] > TRAVEL.near_floor
    if not flying.all():
        before = np.maximum.accumulate(np.where(flying, -1, frames))
        step = step[np.where(before < 0, np.argmin(flying), before)]
    shift[1:, :2] = np.cumsum(step[:, :2], axis=0)
    return _moved(clip, shift, "travel made anew from the feet that stand")


def travel_scaled(clip: Clip, factor: float) -> Clip:
    """The same motion, the places of its root taken `factor` times, heights too."""
    return _moved(clip, (factor - 1.0) * _root(clip), f"root positions x {factor:g}")


def _root(clip: Clip) -> Float[ndarray, "T 3"]:
    return clip.point("pelvis") if isinstance(clip, HumanClip) else clip.root_pos


def _moved(clip: Clip, shift: Float[ndarray, "T 3"], note: str) -> Clip:
    source = clip.source.noting(note)
    if isinstance(clip, HumanClip):
        return replace(clip, positions=clip.positions + shift[:, None], source=source)
    return replace(clip, root_pos=clip.root_pos + shift, source=source)
