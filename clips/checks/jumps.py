"""Poses that jump: limbs that turn in one frame by many times what they turn in the frames around it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips.checks.check import Check, Verdict
from clips.clip import Clip, HumanClip, RobotClip
from clips.config import REPAIR
from robot_models.maths import rotation as rot

_BONES = tuple((f"{s}_{a}", f"{s}_{b}") for s in ("left", "right") for a, b in (
    ("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"),
))  # fmt: skip


def pose_steps(clip: Clip, limbs: int = 1) -> Float[ndarray, "S"]:
    """The turn that so many limbs reach, or so many of a robot's joints, from each frame to the next [rad]."""
    if isinstance(clip, RobotClip):
        turns = np.abs(np.diff(clip.joint_pos, axis=0))
    else:
        along = np.stack([rot.unit(clip.point(b) - clip.point(a)) for a, b in _BONES], axis=1)
        chord = np.linalg.norm(np.diff(along, axis=0), axis=-1)
        turns = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))
    return np.asarray(turns.max(axis=1) if limbs == 1 else np.partition(turns, -limbs, axis=1)[:, -limbs])


def pose_jumps(clip: HumanClip, limbs: int = 1) -> Int[ndarray, "K"]:
    """The steps that stand out: by their size, and against the median of the four before and the four after."""
    steps = pose_steps(clip, limbs)
    around = REPAIR.jump_among
    padded = np.pad(steps, around, mode="edge")
    beside = np.stack([padded[around + k : around + k + len(steps)] for k in range(-around, around + 1) if k])
    least = max(REPAIR.jump_turn, REPAIR.fastest_turn / clip.fps)
    return np.flatnonzero(steps > np.maximum(least, REPAIR.jump_stands_out * np.median(beside, axis=0)))


def check_jumps(clip: Clip) -> Check:
    """Whether a pose jumps that was not led through: clips that were joined, frames that were lost.

    Of 20 recordings of people no step over 15 degrees is more than 2.4 times those around it. Robots' files jump where their
    inverse kinematics did; their spikes are mended by the motors' speed.
    """
    what, limit = (
        "poses follow one another",
        f"no limb turns {np.degrees(REPAIR.jump_turn):.0f} deg in one frame, and calmly around it",
    )
    if not isinstance(clip, HumanClip):
        return Check(what=what, value="a robot's are mended by its motors", limit=limit, verdict="holds")
    jumps = pose_jumps(clip)
    if not len(jumps):
        return Check(what=what, value="no jump", limit=limit, verdict="holds")
    steps = pose_steps(clip)
    worst = int(jumps[np.argmax(steps[jumps])])
    torn = steps[worst] > REPAIR.torn_turn
    verdict: Verdict = "refused" if torn else "doubtful"
    times = ", ".join(f"{(j + 1) / clip.fps:.2f} s" for j in jumps[:4]) + (" ..." if len(jumps) > 4 else "")
    return Check(
        what=what, value=f"{len(jumps)} jumps, of {np.degrees(steps[worst]):.0f} deg at the most", limit=limit, verdict=verdict,
        where=f"at {times}", cure="cut the clip there: its parts can be joined again, with steps between them" if torn else "",
    )  # fmt: skip
