"""Left and right exchanged for a while, as trackers of markers and of video do: exchanged back."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips.checks import knees_ahead
from clips.clip import Clip, HumanClip, RobotClip
from clips.config import BODY, SIDES
from clips.provenance import Repair
from robot_models.maths import intervals_of
from robot_models.maths import rotation as rot

# From the trunk outwards: what a pair hangs on is mended before it.
_PAIRS = (
    ("hip", ""), ("shoulder", ""), ("knee", "hip"), ("elbow", "shoulder"), ("ankle", "knee"), ("wrist", "elbow"), ("toe", "ankle"),
)  # fmt: skip


_LEG, _ARM = ("hip", "knee", "ankle", "toe"), ("shoulder", "elbow", "wrist")


def with_sides_unchanged(clip: Clip) -> Clip:
    """The clip with those pairs of points exchanged back whose left is right for a part of it.

    Where both points of a pair leap to each other's place the sides may have changed. Between two such leaps, the pair is
    exchanged where that gives its bones the lengths that they have in the rest of the clip; hips and shoulders, where it makes
    the hips face as knees, toes and shoulders do.
    """
    if isinstance(clip, RobotClip):
        return clip
    for part, above in _PAIRS:
        if _has(clip, part):
            clip = _mended(clip, part, _exchanged(clip, part, above))
    return clip


def exchanged_everywhere(clip: HumanClip) -> list[str]:
    """Parts whose left and right are exchanged in every frame.

    Exchanged, their bones would have one length; or they lie crosswise under what they hang on. Where hips and shoulders face
    against each other, whichever knees and toes speak against is exchanged with all that hangs on it.
    """
    found = []
    across = np.median(np.sum(_axis(clip, "hip") * _axis(clip, "shoulder"), axis=1))
    if across < -BODY.against:
        legs = float(np.median(knees_ahead(clip))) < 0.0
        found = [p for p in (_LEG if legs else _ARM) if _has(clip, p)]
        for part in found:
            clip = _mended(clip, part, np.ones(clip.frames, dtype=bool))
    for part, above in _PAIRS:
        if above and _has(clip, part):
            lengths = [_lengths(clip, part, above, swap) for swap in (False, True)]
            as_is, other = map(_spread, lengths)
            shorter = np.median(lengths[1]) < np.median(lengths[0])  # bones across the body are longer
            crosswise = np.median(np.sum(_axis(clip, part) * _axis(clip, above), axis=1)) < -BODY.against
            if crosswise or (shorter and as_is > SIDES.least_spread and other < SIDES.much_less * as_is):
                found.append(part)
                clip = _mended(clip, part, np.ones(clip.frames, dtype=bool))
    return found


def _has(clip: HumanClip, part: str) -> bool:
    """Whether both points of a pair are there."""
    return {f"left_{part}", f"right_{part}"} <= set(clip.landmarks)


def _exchanged(clip: HumanClip, part: str, above: str) -> Bool[ndarray, "T"]:
    """Frames in which the two points of a pair stand on each other's side."""
    votes = _bones_vote(clip, part, above) if above else _facing_vote(clip, part)
    out = np.zeros(clip.frames, dtype=bool)
    if not (votes > 0.0).any():
        return out
    left, right = clip.point(f"left_{part}"), clip.point(f"right_{part}")

    def way(a: ndarray, b: ndarray) -> ndarray:
        return np.asarray(np.linalg.norm(a[1:] - b[:-1], axis=1))

    leaps = way(left, left) + way(right, right) - way(left, right) - way(right, left) > SIDES.leap
    edges = [0, *(np.flatnonzero(leaps) + 1), clip.frames]
    for a, b in pairwise(edges):
        out[a:b] = votes[a:b].mean() > 0.0
    if not leaps.any() or out.mean() > SIDES.most:  # nothing changes, or nobody knows which is right
        out[:] = False
    return out


def _bones_vote(clip: HumanClip, part: str, above: str) -> Float[ndarray, "T"]:
    """Above 0 where exchanged bones would be clearly more like those of the rest of the clip than they are."""
    as_is, swapped = (_lengths(clip, part, above, swap) for swap in (False, True))
    usual = np.maximum(np.median(as_is, axis=0), BODY.no_length)
    off, off_swapped = (np.abs(x / usual - 1.0).max(axis=1) for x in (as_is, swapped))
    return np.asarray(SIDES.much_less * off - off_swapped - SIDES.bone_noise)


def _lengths(clip: HumanClip, part: str, above: str, swap: bool) -> Float[ndarray, "T 2"]:
    """Lengths of the left and the right bone that end in a pair of points [m]."""
    ends = ("right", "left") if swap else ("left", "right")
    return np.stack(
        [
            np.linalg.norm(clip.point(f"{end}_{part}") - clip.point(f"{begin}_{above}"), axis=1)
            for begin, end in zip(("left", "right"), ends, strict=True)
        ],
        axis=1,
    )


def _spread(lengths: Float[ndarray, "T 2"]) -> float:
    """How much bones vary, as a share of their length."""
    usual = np.maximum(np.median(lengths, axis=0), BODY.no_length)
    return float(np.median(np.abs(lengths / usual - 1.0).max(axis=1)))


def _facing_vote(clip: HumanClip, part: str) -> Float[ndarray, "T"]:
    """Above 0 where hips or shoulders face against knees and toes, and against each other."""
    if part == "shoulder":
        return np.asarray(-np.sum(_axis(clip, "hip") * _axis(clip, "shoulder"), axis=1) - BODY.against)
    return np.asarray(np.minimum(-knees_ahead(clip) - BODY.behind, 1.0))


def _axis(clip: HumanClip, part: str) -> Float[ndarray, "T 3"]:
    return rot.unit(clip.point(f"left_{part}") - clip.point(f"right_{part}"))


def _mended(clip: HumanClip, part: str, frames: Bool[ndarray, "T"]) -> HumanClip:
    if not frames.any():
        return clip
    left, right = (clip.names.index(clip.landmarks[f"{side}_{part}"]) for side in ("left", "right"))

    def exchange(x: ndarray) -> ndarray:
        out = x.copy()
        out[frames, left], out[frames, right] = x[frames, right], x[frames, left]
        return out

    first = intervals_of(frames)
    where = f"{len(first)} times, first at {first[0][0] / clip.fps:.2f} s"
    repair = Repair(what=f"left and right {part} exchanged back", count=int(frames.sum()), where=where)
    turns = None if clip.orientations is None else exchange(clip.orientations)
    return replace(clip, positions=exchange(clip.positions), orientations=turns, source=clip.source.mended(repair))
