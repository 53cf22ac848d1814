"""Damage that captures have, mended, named and counted; `strict` refuses it instead.

Nothing here changes a sound clip, and mending twice changes nothing more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips.checks import CHECKS, foot_points
from clips.clip import Clip, HumanClip
from clips.config import REPAIR
from clips.edit.bridge import bridged
from clips.edit.false_ends import hips_of, without_calibration_pose, without_false_ends
from clips.edit.flashes import without_flashes
from clips.edit.floor import on_level_floor
from clips.edit.level import upright
from clips.edit.sides import with_sides_unchanged
from clips.errors import ClipError
from clips.provenance import Repair
from robot_models import load_robot
from robot_models.maths import intervals_of


def repair(clip: Clip, *, strict: bool = False) -> Clip:
    """The clip without what no body does, and asked whether it is a body moving (`clips.checks`).

    Mended are flipped sides, rest poses at the ends and amid it, repeated frames, spikes, a world that leans, a floor that drifts.

    Args:
        clip: as read and cut.
        strict: refuse a clip that needs any repair, or needed one while it was read.

    Raises:
        ClipError: the hips or the pose are torn in mid-clip, the travel is missing, the points are no body's; or strict, and
            something was mended.
    """
    for mend in _MENDS:
        clip = mend(clip)
    _refuse_a_tear(clip)
    for check in (question(clip) for question in CHECKS):
        if check.verdict == "refused":
            raise check.refusal(clip.source.file)
    foot_points.cache_clear()  # the points of an hour are large
    if strict and clip.source.repairs:
        raise ClipError(
            clip.source.file, found="; ".join(map(str, clip.source.repairs)), expected="a clip that needs no repair",
            cure="mend it at its source, or do without the strict reading",
        )  # fmt: skip
    return clip


def without_repeats(clip: Clip) -> Clip:
    """Short stretches that repeat a frame in the middle of a movement, led through instead."""
    steps = np.concatenate([np.abs(np.diff(x.reshape(clip.frames, -1), axis=0)) for x in _numbers(clip)], axis=1)
    step = np.append(steps.max(axis=1), 0.0)  # from this frame to the next
    stalled = np.zeros(clip.frames, dtype=bool)
    for a, b in intervals_of(step == 0.0):
        moving = a > 0 and b < clip.frames - 1 and min(step[a - 1], step[b]) * clip.fps > REPAIR.stalled_speed
        if moving and b - a <= max(1.0, REPAIR.gap_s * clip.fps):
            stalled[a + 1 : b + 1] = True
    if not stalled.any():
        return clip
    repair = Repair(what="repeated frames led through", count=int(stalled.sum()), where=_at(stalled, clip.fps))
    return bridged(clip, stalled, repair)


def without_spikes(clip: Clip) -> Clip:
    """Values that leave faster than a body can and are back within a tenth of a second, led through instead."""
    mended: dict[str, Any] = {}
    found = []
    for name, values, fastest in _tracks(clip):
        out = values.copy()
        for column in range(values.shape[1]):
            for a, b in _spikes(out[:, column], fastest[column] / clip.fps, max(1, round(REPAIR.gap_s * clip.fps))):
                share = (np.arange(a, b) - (a - 1.0)) / (b - a + 1.0)
                out[a:b, column] = (1.0 - share)[:, None] * out[a - 1, column] + share[:, None] * out[b, column]
                found.append((a, b - a))
        mended[name] = out.reshape(getattr(clip, name).shape)
    if not found:
        return clip
    where = f"first at {min(found)[0] / clip.fps:.2f} s"
    repair = Repair(what="spikes led through", count=sum(n for _, n in found), where=where, of="samples")
    return replace(clip, **mended, source=clip.source.mended(repair))


_MENDS: tuple[Callable[[Clip], Clip], ...] = (
    with_sides_unchanged,  # first: a flip near an end is no rest pose
    without_flashes,
    without_calibration_pose,
    without_false_ends,
    without_repeats,
    without_spikes,
    upright,
    on_level_floor,
)


def _spikes(x: Float[ndarray, "T d"], most: float, longest: int) -> list[tuple[int, int]]:
    """Frame ranges that are entered and left by steps beyond `most`, between frames that agree."""
    over = np.linalg.norm(np.diff(x, axis=0), axis=1) > most
    spikes, after = [], 0
    for step in np.flatnonzero(over):
        a = int(step) + 1
        if a < after:
            continue
        for b in range(a + 1, min(a + longest, len(x) - 1) + 1):
            if over[b - 1] and np.linalg.norm(x[b] - x[a - 1]) <= most * (b - a + 1):
                spikes.append((a, b))
                after = b
                break
    return spikes


def _tracks(clip: Clip) -> list[tuple[str, Float[ndarray, "T C d"], Float[ndarray, "C"]]]:
    """What may spike: field of the clip, its values as columns, and the greatest speed of each column."""
    if isinstance(clip, HumanClip):
        return [("positions", clip.positions, np.full(len(clip.names), REPAIR.fastest_point))]
    robot = load_robot(clip.robot)
    motors = robot.velocity[[robot.joint(n) for n in clip.joint_names]]
    return [
        ("root_pos", clip.root_pos[:, None], np.array([REPAIR.fastest_hips])),
        ("joint_pos", clip.joint_pos[..., None], motors),
    ]


def _refuse_a_tear(clip: Clip) -> None:
    """Joined clips: the hips are elsewhere from one frame to the next, and stay there."""
    step = np.linalg.norm(np.diff(hips_of(clip), axis=0), axis=1)
    torn = np.flatnonzero(step * clip.fps > REPAIR.fastest_hips)
    if len(torn):
        a = int(torn[0])
        raise ClipError(
            f"{clip.source.file}, frame {a + 1}",
            found=f"hips that jump {step[a]:.2f} m between {a / clip.fps:.2f} s and {(a + 1) / clip.fps:.2f} s",
            expected=f"one motion: at most {REPAIR.fastest_hips:g} m/s",
            cure="cut the clip there (its parts can be joined again, with steps between them); or is its frame rate wrong?",
        )


def _numbers(clip: Clip) -> list[ndarray]:
    return [clip.positions] if isinstance(clip, HumanClip) else [clip.root_pos, clip.root_quat, clip.joint_pos]


def _at(frames: Bool[ndarray, "T"], fps: float) -> str:
    return f"first at {np.argmax(frames) / fps:.2f} s"
