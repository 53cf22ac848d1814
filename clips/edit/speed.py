"""Changes that a dancer asks for: another tempo, a tempo that changes, the other side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip
from clips.edit.resample import sample_clip
from clips.errors import ClipError


def at_speed(clip: Clip, factor: float) -> Clip:
    """The same motion `factor` times as fast: every frame is kept, the frame rate changes.

    Raises:
        ClipError: the factor is not positive.
    """
    if not 0.0 < factor < 100.0:
        raise ClipError("speed", found=repr(factor), expected="a positive factor: 0.5 is half as fast")
    if factor == 1.0:
        return clip
    return replace(clip, fps=clip.fps * factor, source=clip.source.noting(f"played at {factor:g} times its speed"))


def warp_time(clip: Clip, pace: Float[ndarray, "T"]) -> Clip:
    """The same motion at a pace that changes: frame t goes by `pace[t]` times as fast, the frame rate stays.

    Raises:
        ClipError: a pace is not positive.
    """
    if not (pace > 0.0).all():
        raise ClipError("pace", found=f"{pace.min():g}", expected="positive factors")
    took = np.concatenate(([0.0], np.cumsum(2.0 / (pace[1:] + pace[:-1]))))  # frames of the new clip up to each old one
    times = np.interp(np.arange(int(took[-1] + 1e-9) + 1), took, np.arange(len(pace)))
    slowest = int(pace.argmin())
    note = f"paced: {len(pace)} -> {len(times)} frames, {pace.min():.2f} of its speed at {slowest / clip.fps:.2f} s"
    return sample_clip(clip, times, clip.fps, note)


def mirror(clip: HumanClip) -> HumanClip:
    """Left and right exchanged: reflected in the plane y = 0, with the landmarks of the other side.

    A reflection M turns an orientation R into M R M, again a rotation: of its axis only y keeps its sign.
    """

    def other(name: str) -> str:
        side, _, part = name.partition("_")
        return {"left": f"right_{part}", "right": f"left_{part}"}.get(side, name)

    turned = None if clip.orientations is None else clip.orientations * np.array([1.0, -1.0, 1.0, -1.0])
    return replace(
        clip,
        positions=clip.positions * np.array([1.0, -1.0, 1.0]),
        orientations=turned,
        landmarks={other(k): point for k, point in clip.landmarks.items()},
        source=clip.source.noting("mirrored: left and right exchanged"),
    )
