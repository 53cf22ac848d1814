"""Resampling by time: positions by cubic splines, rotations by slerp, the duration kept to one frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip
from clips.errors import ClipError
from robot_models.maths import rotation as rot


def resample(clip: Clip, fps: float) -> Clip:
    """The same motion at another frame rate; the first frame stays, the last sample is never past the last frame."""
    if abs(fps - clip.fps) < 1e-9 * fps:
        return clip
    times = new_times(clip.frames, clip.fps, fps)
    note = f"resampled {clip.fps:.6g} -> {fps:.6g} fps ({clip.frames} -> {len(times)} frames)"
    return sample_clip(clip, times, fps, note)


def sample_clip(clip: Clip, times: Float[ndarray, "N"], fps: float, note: str) -> Clip:
    """The clip at fractional frames, played at `fps`; `note` says in its source what was done."""
    source = clip.source.noting(note)
    if isinstance(clip, HumanClip):
        turns = None if clip.orientations is None else sample_quat(clip.orientations, times)
        return replace(clip, fps=fps, positions=sample(clip.positions, times), orientations=turns, source=source)
    return replace(
        clip,
        fps=fps,
        root_pos=sample(clip.root_pos, times),
        root_quat=sample_quat(clip.root_quat, times),
        joint_pos=sample(clip.joint_pos, times),
        source=source,
    )


def new_times(frames: int, fps_in: float, fps_out: float) -> Float[ndarray, "N"]:
    """Sample times in units of input frames, from 0 to at most the last frame."""
    count = int(np.floor((frames - 1) / fps_in * fps_out + 1e-9)) + 1
    return np.minimum(np.arange(count) * (fps_in / fps_out), frames - 1.0)


def sample(x: Float[ndarray, "T ..."], times: Float[ndarray, "N"]) -> Float[ndarray, "N ..."]:
    """Values at fractional frames by a natural cubic spline (fourth order inside)."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(np.arange(len(x)), x, axis=0, bc_type="natural")(times))


def sample_quat(q: Float[ndarray, "T ... 4"], times: Float[ndarray, "N"]) -> Float[ndarray, "N ... 4"]:
    """Rotations at fractional frames by slerp between neighbours."""
    low = np.minimum(times.astype(int), len(q) - 2)
    part = (times - low).reshape(-1, *[1] * (q.ndim - 2))
    return rot.continuous(rot.normalise(rot.slerp(q[low], q[low + 1], np.broadcast_to(part, q[low].shape[:-1]))))


def _check_range(clip: Clip, start_s: float, end_s: float | None) -> None:
    length_s = (clip.frames - 1) / clip.fps
    if not (0.0 <= start_s < length_s and (end_s is None or start_s < end_s)):
        raise ClipError(
            f"{clip.source.file}, cut",
            found=f"from {start_s} s to {'the end' if end_s is None else f'{end_s} s'}",
            expected=f"0 <= start < end inside the clip's {length_s:.2f} s",
        )


def cut(clip: Clip, start_s: float, end_s: float | None) -> Clip:
    """The frames from `start_s` to `end_s` seconds, both ends included.

    Raises:
        ClipError: the range is empty or lies outside the clip.
    """
    _check_range(clip, start_s, end_s)
    first = round(start_s * clip.fps)
    last = clip.frames if end_s is None else min(clip.frames, round(end_s * clip.fps) + 1)
    if first == 0 and last == clip.frames:
        return clip
    source = clip.source.noting(f"cut to frames [{first}, {last})")
    part = slice(first, last)
    if isinstance(clip, HumanClip):
        turns = None if clip.orientations is None else clip.orientations[part]
        return replace(clip, positions=clip.positions[part], orientations=turns, source=source)
    return replace(
        clip,
        root_pos=clip.root_pos[part],
        root_quat=clip.root_quat[part],
        joint_pos=clip.joint_pos[part],
        source=source,
    )
