"""Frames that are wrong, led through between the good ones beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from numpy import ndarray

from clips.clip import Clip, HumanClip
from clips.edit.resample import sample_quat
from clips.provenance import Repair
from robot_models.maths import rotation as rot


def bridged(clip: Clip, bad: Bool[ndarray, "T"], repair: Repair) -> Clip:
    """The bad frames led through between the good ones beside them."""
    good = np.flatnonzero(~bad)
    times = np.interp(np.flatnonzero(bad), good, np.arange(len(good)))
    low, part = np.minimum(times.astype(int), len(good) - 2), times % 1.0

    def straight(x: ndarray) -> ndarray:
        out, share = x.copy(), part.reshape(-1, *[1] * (x.ndim - 1))
        out[bad] = (1.0 - share) * x[good][low] + share * x[good][low + 1]
        return out

    def turning(q: ndarray) -> ndarray:
        out = q.copy()
        out[bad] = sample_quat(q[good], times)
        return rot.continuous(out)

    source = clip.source.mended(repair)
    if isinstance(clip, HumanClip):
        positions = straight(clip.positions)
        turned = None if clip.orientations is None else turning(clip.orientations)
        return replace(clip, positions=positions, orientations=turned, source=source)
    return replace(
        clip,
        root_pos=straight(clip.root_pos),
        root_quat=turning(clip.root_quat),
        joint_pos=straight(clip.joint_pos),
        source=source,
    )
