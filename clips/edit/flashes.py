"""Poses that flash up in mid-clip for a frame or a few, as a rest pose does where tracking was lost."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from clips.checks import pose_jumps
from clips.clip import Clip, HumanClip
from clips.config import REPAIR
from clips.edit.bridge import bridged
from clips.provenance import Repair


def without_flashes(clip: Clip) -> Clip:
    """A person's poses between two jumps of several limbs within a tenth of a second, led through instead."""
    if not isinstance(clip, HumanClip):
        return clip
    flash = np.zeros(clip.frames, dtype=bool)
    after = -1
    for a, b in pairwise(map(int, pose_jumps(clip, REPAIR.flash_limbs))):
        if a > after and b - a <= max(1.0, REPAIR.gap_s * clip.fps):
            flash[a + 1 : b + 1], after = True, b
    if not flash.any():
        return clip
    where = f"first at {np.argmax(flash) / clip.fps:.2f} s"
    return bridged(clip, flash, Repair(what="poses that flash up led through", count=int(flash.sum()), where=where))
