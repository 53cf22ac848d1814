"""Mistakes of capture and of naming, put into sound recordings: what `clips.checks` and `repair` are judged by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip
from robot_models.maths import rotation as rot

REST = {  # of a person with arms stretched out sideways, facing +x, from the pelvis [m]
    "hip": (0.0, 0.09, -0.03), "knee": (0.02, 0.09, -0.46), "ankle": (-0.01, 0.09, -0.88), "toe": (0.13, 0.09, -0.94),
    "shoulder": (0.0, 0.18, 0.48), "elbow": (0.0, 0.45, 0.48), "wrist": (0.0, 0.70, 0.48),
}  # fmt: skip
"""Left side of the rest pose that files begin with; the right one is its mirror image."""


def with_rest(clip: Clip, count: int, *, at_the_end: bool = False) -> Clip:
    """So many frames of a rest pose where the clip begins or ends: a T-pose, or a robot's joints all at zero."""
    at = -1 if at_the_end else 0

    def joined(x: Any, one: Any) -> Any:
        held = np.repeat(np.asarray(one)[None], count, axis=0)
        return np.concatenate((x, held) if at_the_end else (held, x))

    if not isinstance(clip, HumanClip):
        zero = np.zeros_like(clip.joint_pos[0])
        return replace(
            clip, joint_pos=joined(clip.joint_pos, zero), root_pos=joined(clip.root_pos, clip.root_pos[at]),
            root_quat=joined(clip.root_quat, clip.root_quat[at]),
        )  # fmt: skip
    pose, pelvis = clip.positions[at].copy(), clip.point("pelvis")[at]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for part, (x, y, z) in REST.items():
            if f"{side}_{part}" in clip.landmarks:
                scale = clip.height / 1.75
                pose[clip.names.index(clip.landmarks[f"{side}_{part}"])] = pelvis + scale * np.array([x, sign * y, z])
    return replace(clip, positions=joined(clip.positions, pose), orientations=None)


def travelling(clip: Clip, factor: float | Sequence[float]) -> Clip:
    """The places of its root taken by a factor, or by one per axis."""
    by = np.asarray(factor, dtype=float)
    if isinstance(clip, HumanClip):
        return replace(clip, positions=clip.positions + ((by - 1.0) * clip.point("pelvis"))[:, None])
    return replace(clip, root_pos=clip.root_pos * by)


def tilted(clip: Clip, degrees: float, heading: float) -> Clip:
    """The world leaning by so much towards a heading [deg]."""
    about = np.array([-np.sin(np.radians(heading)), np.cos(np.radians(heading)), 0.0])
    turn = rot.exp(np.radians(degrees) * about)

    def points(x: Float[ndarray, "... 3"]) -> ndarray:
        return rot.rotate(np.broadcast_to(turn, (*x.shape[:-1], 4)), x)

    def turns(q: Float[ndarray, "... 4"]) -> ndarray:
        return rot.multiply(np.broadcast_to(turn, q.shape), q)

    if isinstance(clip, HumanClip):
        turned = None if clip.orientations is None else turns(clip.orientations)
        return replace(clip, positions=points(clip.positions), orientations=turned)
    return replace(clip, root_pos=points(clip.root_pos), root_quat=turns(clip.root_quat))


def exchanged(clip: HumanClip, parts: Sequence[str], frames: Any) -> HumanClip:
    """Left and right of some parts of a person exchanged in some frames."""
    positions = clip.positions.copy()
    for part in parts:
        left, right = (clip.names.index(clip.landmarks[f"{side}_{part}"]) for side in ("left", "right"))
        positions[frames, left], positions[frames, right] = clip.positions[frames, right], clip.positions[frames, left]
    return replace(clip, positions=positions)
