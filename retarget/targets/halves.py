"""Half a body from one clip and half from another, on one time line; or legs that only stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Clip, HumanClip, Provenance, RobotClip
from clips.edit import resample
from retarget.targets.robot_figure import as_figure
from robot_models import FEET
from robot_models.maths import rotation as rot

_LOWER = ("pelvis", *(f"{s}_{part}" for s in FEET for part in ("hip", "knee", "ankle", "toe")))
_UPPER = ("chest", "neck", "head", *(f"{s}_{part}" for s in FEET for part in ("shoulder", "elbow", "wrist")))
_ABOVE = {
    "hip": "pelvis", "knee": "hip", "ankle": "knee", "toe": "ankle", "shoulder": "chest", "elbow": "shoulder",
    "wrist": "elbow", "neck": "chest", "head": "neck",
}  # fmt: skip
_BEND = 0.15  # rad that thighs and shanks of standing legs are off the vertical
_TOE = (0.13, 0.0, -0.05)  # from ankle to toe of who stands [m]


def join_halves(legs: Clip, arms: Clip) -> HumanClip:
    """Pelvis and legs of one clip, trunk, head and arms of the other; as long as the shorter, at the first one's rate.

    The upper half keeps its height and its way over its own pelvis, turned from where its hips face to where the legs' do,
    and scaled by the ratio of statures. Orientations are kept where both clips have them of one skeleton.

    Args:
        legs: whose way over the floor is taken.
        arms: whose trunk moves; where its feet are does not count.

    Raises:
        ClipError: too few frames in common.
    """
    lower = as_figure(legs) if isinstance(legs, RobotClip) else legs
    upper = as_figure(arms) if isinstance(arms, RobotClip) else arms
    upper = _at_rate(upper, lower.fps)
    frames = min(lower.frames, upper.frames)
    turn = rot.from_yaw(_heading(lower)[:frames] - _heading(upper)[:frames])
    scale = lower.height / upper.height
    below, above = (_points(clip, marks, frames) for clip, marks in ((lower, _LOWER), (upper, _UPPER)))
    for mark, points in above.items():
        beside = points - upper.point("pelvis")[:frames]
        above[mark] = lower.point("pelvis")[:frames] + scale * rot.rotate(turn, beside)
    turns = None
    if lower.orientations is not None and upper.orientations is not None and _one_skeleton(lower, upper):
        turns = _turns(lower, below, frames) | {
            mark: rot.multiply(turn, q) for mark, q in _turns(upper, above, frames).items()
        }
    source = lower.source.noting(f"trunk, head and arms of {upper.source.file}, {frames} frames")
    return _figure(lower, below | above, turns, replace(source, file=f"{lower.source.file} + {upper.source.file}"))


def with_standing_legs(clip: Clip) -> HumanClip:
    """Trunk, head and arms of a clip over legs that stand where they are: of who sits, signs or speaks.

    The pelvis stands still over the feet and faces where it does in the mean; the trunk leans and turns over it.
    """
    figure = as_figure(clip) if isinstance(clip, RobotClip) else clip
    frames = figure.frames
    facing = _heading(figure)
    ahead = float(np.arctan2(np.sin(facing).mean(), np.cos(facing).mean()))
    thigh, shank = (
        float(np.median(np.linalg.norm(figure.point(f"left_{a}") - figure.point(f"left_{b}"), axis=1)))
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    )
    wide = 0.5 * float(np.median(np.linalg.norm(figure.point("left_hip") - figure.point("right_hip"), axis=1)))
    low = -(thigh + shank) * np.cos(_BEND)
    stand = {"pelvis": np.zeros(3)}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        hip = np.array([0.0, sign * wide, 0.0])
        ankle = hip + np.array([(thigh - shank) * np.sin(_BEND), 0.0, low])
        stand |= {
            f"{side}_hip": hip, f"{side}_knee": hip + thigh * np.array([np.sin(_BEND), 0.0, -np.cos(_BEND)]),
            f"{side}_ankle": ankle, f"{side}_toe": ankle + _TOE,
        }  # fmt: skip
    place = np.median(figure.point("pelvis"), axis=0) * [1.0, 1.0, 0.0] - [0.0, 0.0, low + _TOE[2]]
    turn = rot.from_yaw(np.array(ahead))
    lower = {mark: np.tile(place + rot.rotate(turn, p), (frames, 1)) for mark, p in stand.items()}
    upper = _points(figure, _UPPER, frames)
    upper = {mark: lower["pelvis"] + points - figure.point("pelvis") for mark, points in upper.items()}
    source = figure.source.noting("legs stand still; trunk, head and arms as recorded")
    return _figure(figure, lower | upper, None, source)


def _at_rate(clip: HumanClip, fps: float) -> HumanClip:
    even = resample(clip, fps)
    assert isinstance(even, HumanClip)
    return even


def _heading(clip: HumanClip) -> Float[ndarray, "T"]:
    """Where the hips face [rad], without jumps."""
    left = clip.point("left_hip") - clip.point("right_hip")
    return np.unwrap(np.arctan2(-left[:, 0], left[:, 1]))


def _points(clip: HumanClip, marks: tuple[str, ...], frames: int) -> dict[str, Float[ndarray, "T 3"]]:
    known = [m for m in marks if m in clip.landmarks or m in ("pelvis", "chest", "neck")]
    return {mark: clip.point(mark)[:frames] for mark in known}


def _turns(clip: HumanClip, points: dict[str, ndarray], frames: int) -> dict[str, Float[ndarray, "T 4"]]:
    found = {mark: clip.orientation(mark) for mark in points}
    return {mark: q[:frames] for mark, q in found.items() if q is not None}


def _one_skeleton(a: HumanClip, b: HumanClip) -> bool:
    """Whether orientations mean the same in both: bodies upright at zero, or the same bones by name."""
    return (a.upright and b.upright) or (a.upright == b.upright and a.names == b.names and a.landmarks == b.landmarks)


def _figure(
    like: HumanClip, points: dict[str, ndarray], turns: dict[str, ndarray] | None, source: Provenance
) -> HumanClip:
    names = tuple(points)
    whole = turns is not None and set(turns) == set(names)
    parents = []
    for name in names:
        side, _, part = name.rpartition("_")
        above = _ABOVE.get(part, "pelvis" if part == "chest" else "")
        above = f"{side}_{above}" if side and above not in ("pelvis", "chest") else above
        parents.append(names.index(above) if above in names else -1)
    return replace(
        like, names=names, positions=np.stack([points[n] for n in names], axis=1),
        orientations=rot.normalise(np.stack([turns[n] for n in names], axis=1)) if whole and turns is not None else None,
        parents=tuple(parents), landmarks={n: n for n in names}, source=source,
    )  # fmt: skip
