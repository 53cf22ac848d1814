"""Where a clip takes place: brought to the origin, facing forward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip
from robot_models.maths import rotation as rot


def recentre(clip: Clip) -> Clip:
    """The same motion turned and shifted so that it begins over the origin, facing +x; heights stay."""
    if isinstance(clip, HumanClip):
        left = clip.point("left_hip")[0] - clip.point("right_hip")[0]
        facing = float(np.arctan2(-left[0], left[1]))  # left turned by -90 degrees
        start = clip.point("pelvis")[0]
    else:
        facing, start = float(rot.yaw(clip.root_quat[0])), clip.root_pos[0]
    note = f"moved by ({-start[0]:.3f}, {-start[1]:.3f}) m, then turned by {np.degrees(-facing):.1f} deg about the vertical"
    ahead = rot.rotate(rot.from_yaw(np.array(-facing)), np.array([-start[0], -start[1], 0.0]))
    return placed(clip, -facing, ahead, note)


def placed(clip: Clip, turn_rad: float, shift: Float[ndarray, "3"], note: str) -> Clip:
    """The same motion turned about the world's vertical, then shifted [m]; `note` goes into its source."""
    turn = rot.from_yaw(np.array(turn_rad))
    source = clip.source.noting(note)

    def points(x: ndarray) -> ndarray:
        return rot.rotate(np.broadcast_to(turn, (*x.shape[:-1], 4)), x) + shift

    def turns(q: ndarray) -> ndarray:
        return rot.normalise(rot.multiply(np.broadcast_to(turn, q.shape), q))

    if isinstance(clip, HumanClip):
        orientations = None if clip.orientations is None else turns(clip.orientations)
        return replace(clip, positions=points(clip.positions), orientations=orientations, source=source)
    return replace(clip, root_pos=points(clip.root_pos), root_quat=turns(clip.root_quat), source=source)
