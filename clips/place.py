"""Where a clip takes place: brought to the origin, facing forward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clips.clip import Clip, HumanClip
from robot_models import rotation as rot


def recentred(clip: Clip) -> Clip:
    """The same motion turned and shifted so that it begins over the origin, facing +x; heights stay."""
    if isinstance(clip, HumanClip):
        left = clip.point("left_hip")[0] - clip.point("right_hip")[0]
        facing = float(np.arctan2(-left[0], left[1]))  # left turned by -90 degrees
        start = clip.point("pelvis")[0]
    else:
        facing, start = float(rot.yaw(clip.root_quat[0])), clip.root_pos[0]
    turn = rot.from_yaw(np.array(-facing))
    shift = np.array([start[0], start[1], 0.0])
    note = f"moved by ({-start[0]:.3f}, {-start[1]:.3f}) m, then turned by {np.degrees(-facing):.1f} deg about the vertical"
    source = clip.source.noting(note)

    def points(x: np.ndarray) -> np.ndarray:
        return rot.rotate(np.broadcast_to(turn, (*x.shape[:-1], 4)), x - shift)

    def turns(q: np.ndarray) -> np.ndarray:
        return rot.normalise(rot.multiply(np.broadcast_to(turn, q.shape), q))

    if isinstance(clip, HumanClip):
        orientations = None if clip.orientations is None else turns(clip.orientations)
        return replace(clip, positions=points(clip.positions), orientations=orientations, source=source)
    return replace(clip, root_pos=points(clip.root_pos), root_quat=turns(clip.root_quat), source=source)
