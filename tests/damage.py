"""Mistakes of capture and of naming, put into sound recordings."""

from dataclasses import replace
from functools import cache

import numpy as np

from clips import HumanClip, ReadOptions, read_clip
from clips.edit import cut
from robot_models.maths import rotation as rot

RATES = {"csv/g1moves": 60.0, "csv/g1_": 60.0, "csv/lafan1": 30.0, "amc/": 120.0}
"""Frames per second of shared files that do not say theirs, by how their names begin."""


def read_shared(shared, file, start=None, end=None):
    """A shared recording at its rate, or a part of it [s]."""
    clip = _read(shared / file, next((rate for name, rate in RATES.items() if file.startswith(name)), None))
    return clip if start is None else cut(clip, start, end)


@cache
def _read(path, fps):
    return read_clip(path, ReadOptions(fps=fps))


def travelling(clip, factor):
    """The places of its root taken by a factor, or by one per axis."""
    factor = np.asarray(factor, dtype=float)
    if isinstance(clip, HumanClip):
        return replace(clip, positions=clip.positions + ((factor - 1.0) * clip.point("pelvis"))[:, None])
    return replace(clip, root_pos=clip.root_pos * factor)


def tilted(clip, degrees, heading):
    """The world leaning by so much towards a heading [deg]."""
    about = np.array([-np.sin(np.radians(heading)), np.cos(np.radians(heading)), 0.0])
    turn = rot.exp(np.radians(degrees) * about)

    def points(x):
        return rot.rotate(np.broadcast_to(turn, (*x.shape[:-1], 4)), x)

    def turns(q):
        return rot.multiply(np.broadcast_to(turn, q.shape), q)

    if isinstance(clip, HumanClip):
        turned = None if clip.orientations is None else turns(clip.orientations)
        return replace(clip, positions=points(clip.positions), orientations=turned)
    return replace(clip, root_pos=points(clip.root_pos), root_quat=turns(clip.root_quat))


def exchanged(clip, parts, frames):
    """Left and right of some parts of a person exchanged in some frames."""
    positions = clip.positions.copy()
    for part in parts:
        left, right = (clip.names.index(clip.landmarks[f"{side}_{part}"]) for side in ("left", "right"))
        positions[frames, left], positions[frames, right] = clip.positions[frames, right], clip.positions[frames, left]
    return replace(clip, positions=positions)
