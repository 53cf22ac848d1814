"""Frames at the ends of a clip that are no motion: a pose that jumps into the dance, a calibration pose held still."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips.checks import pose_steps
from clips.clip import MIN_FRAMES, Clip, RobotClip
from clips.config import REPAIR
from clips.edit.resample import cut
from clips.provenance import Repair
from robot_models.maths import rotation as rot

_LEFT_OUT = "frames left out at the"


def without_false_ends(clip: Clip) -> Clip:
    """Without the frames before a jump that no body makes near the start, and after one near the end.

    Files often begin with their rest pose, for one frame or for seconds, and some end with it. A jump moves the hips or turns
    a limb by far more than the steps before and after it.
    """
    turns, hips = _steps(clip)
    last = _after_the_jump(turns[::-1], hips[::-1], clip.fps)
    if last:
        clip = _kept(clip, slice(0, clip.frames - last), f"{_size(turns, -last)} before them")
        turns, hips = _steps(clip)
    first = _after_the_jump(turns, hips, clip.fps)
    return _kept(clip, slice(first, None), f"{_size(turns, first - 1)} after them") if first else clip


def without_calibration_pose(clip: Clip) -> Clip:
    """Without a lead in which a person stands still with arms stretched out sideways."""
    if isinstance(clip, RobotClip):
        return clip
    arms = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        chain = [clip.point(f"{side}_{p}") for p in ("shoulder", "elbow", "wrist")]
        arms += [sign * rot.unit(b - a) for a, b in pairwise(chain)]
    stretched = np.stack(arms)
    level = (np.abs(stretched[..., 2]) < REPAIR.level_arm).all(axis=0)
    straight = np.linalg.norm(stretched.mean(axis=0), axis=-1) > REPAIR.straight_arms
    body = np.stack([clip.point(k) for k in clip.landmarks], axis=1)
    ahead = max(1, round(REPAIR.gap_s * clip.fps))  # so that a marker's noise is no speed
    later = body[np.minimum(np.arange(clip.frames) + ahead, clip.frames - 1)]
    still = np.linalg.norm(later - body, axis=-1).max(axis=1) < REPAIR.still_speed * ahead / clip.fps
    lead = int(np.argmin(np.append(level & straight & still, False)))
    if lead < max(2.0, REPAIR.gap_s * clip.fps) or clip.frames - lead < MIN_FRAMES:
        return clip
    turns, hips = _steps(clip)
    lead += _after_the_jump(turns[lead:], hips[lead:], clip.fps)  # the last tenth of a second before one is not still
    return _kept(clip, slice(lead, None), "a T-pose held still")


def hips_of(clip: Clip) -> Float[ndarray, "T 3"]:
    """Where the hips are [m]: their middle, or a robot's root."""
    if isinstance(clip, RobotClip):
        return clip.root_pos
    return np.asarray(0.5 * (clip.point("left_hip") + clip.point("right_hip")))


def _steps(clip: Clip) -> tuple[Float[ndarray, "S"], Float[ndarray, "S"]]:
    """From each frame to the next: the largest turn [rad], and the speed of the hips [m/s]."""
    return pose_steps(clip), np.linalg.norm(np.diff(hips_of(clip), axis=0), axis=1) * clip.fps


def _after_the_jump(turns: Float[ndarray, "S"], hips: Float[ndarray, "S"], fps: float) -> int:
    """The frame behind the last jump among the first frames, 0 where there is none; steps in their order from the end asked for."""
    still = (turns * fps < REPAIR.still_turn) & (hips < REPAIR.still_speed)
    lead = int(np.argmin(np.append(still, False)))  # steps that nothing moves in
    early = np.arange(len(turns)) < max(2, round(REPAIR.false_start_s * fps))
    torn = hips > REPAIR.fastest_hips
    jumps = torn | _stands_out(turns, REPAIR.jump_turn) | _stands_out(hips, REPAIR.jump_speed)
    found = np.flatnonzero(jumps & early)
    first, frames = int(found[-1]) + 1 if len(found) else 0, len(turns) + 1
    if 0 < lead < len(turns) and turns[lead + 1 :].sum() > turns[:lead].sum():  # what moves is the dance
        follows = turns[lead + 1 : lead + 2].sum()
        if turns[lead] > max(REPAIR.jump_turn, REPAIR.out_of_stillness * follows) and frames - lead - 1 >= MIN_FRAMES:
            return max(first, lead + 1)
    return first if frames - first >= max(MIN_FRAMES, REPAIR.least_left * frames) else 0


def _stands_out(steps: Float[ndarray, "S"], least: float) -> Bool[ndarray, "S"]:
    """Steps that are larger than `least`, and many times larger than the ones beside them."""
    beside = np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    return np.asarray(steps > np.maximum(least, REPAIR.stands_out * beside))


def _size(turns: Float[ndarray, "S"], step: int) -> str:
    turned = np.degrees(turns[step])
    return f"the pose jumps by {turned:.0f} deg" if turned > np.degrees(REPAIR.jump_turn) else "the hips jump"


def _kept(clip: Clip, frames: slice, why: str) -> Clip:
    """A part of the clip, from its start or to its end."""
    first, last, _ = frames.indices(clip.frames)
    count = first + clip.frames - last
    kept = cut(clip, first / clip.fps, None if last == clip.frames else (last - 1) / clip.fps)
    end, shown = (
        ("start", f"the first {first / clip.fps:.2f} s") if first else ("end", f"the last {count / clip.fps:.2f} s")
    )
    repair = Repair(what=f"{_LEFT_OUT} {end} ({why})", count=count, where=shown)
    return replace(kept, source=clip.source.mended(repair))


def left_out_at_start(clip: Clip) -> float:
    """Seconds that a rest pose before the dance took of its file."""
    frames = sum(r.count for r in clip.source.repairs if r.what.startswith(f"{_LEFT_OUT} start"))
    return frames / clip.fps
