"""A world that leans, as a camera's frame does: turned upright by where feet stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.checks import fit_floor, foot_points
from clips.clip import Clip, HumanClip
from clips.config import LEAN
from clips.provenance import Repair
from robot_models.maths import rotation as rot

_UP = np.array([0.0, 0.0, 1.0])


def upright(clip: Clip) -> Clip:
    """The clip turned so that its floor is level, where feet show beyond doubt that it leans by more than a few degrees.

    A rotation about the hips' first place on the floor: nothing is bent. A clip whose floor was stated to stay is left alone.
    """
    plane = None if clip.source.stated("floor") else fit_floor(foot_points(clip), clip.fps)
    if plane is None or not plane.certain or not LEAN.least_deg < plane.lean_deg < LEAN.most_deg:
        return clip
    normal = rot.unit(np.array([*-plane.slope, 1.0]))
    what = f"a leaning world turned upright ({plane.lean_deg:.1f} deg, rising towards {plane.direction_deg:.0f} deg)"
    repair = Repair(what=what, count=clip.frames, where=f"{100 * plane.standing:.0f} % of {plane.stands} stands agree")
    return replace(turned(clip, between(normal, _UP)), source=clip.source.mended(repair))


def between(a: Float[ndarray, "3"], b: Float[ndarray, "3"]) -> Float[ndarray, "4"]:
    """The shortest rotation (wxyz) that takes unit vector a to b."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    return rot.exp(axis / max(sine, 1e-12) * np.arctan2(sine, float(a @ b)))


def turned(clip: Clip, turn: Float[ndarray, "4"]) -> Clip:
    """The same motion turned about the hips' first place on the floor."""
    first = (
        0.5 * (clip.point("left_hip") + clip.point("right_hip"))[0] if isinstance(clip, HumanClip) else clip.root_pos[0]
    )
    about = first * (1.0, 1.0, 0.0)

    def points(x: ndarray) -> ndarray:
        return np.asarray(about + rot.rotate(np.broadcast_to(turn, (*x.shape[:-1], 4)), x - about))

    def turns(q: ndarray) -> ndarray:
        return rot.normalise(rot.multiply(np.broadcast_to(turn, q.shape), q))

    if isinstance(clip, HumanClip):
        orientations = None if clip.orientations is None else turns(clip.orientations)
        return replace(clip, positions=points(clip.positions), orientations=orientations)
    return replace(clip, root_pos=points(clip.root_pos), root_quat=turns(clip.root_quat))
