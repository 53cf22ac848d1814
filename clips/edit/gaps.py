"""Lost samples of named points: short gaps filled, lost ends cut off, points that nothing needs left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips.config import REPAIR
from clips.errors import ClipError
from clips.provenance import Repair
from robot_models.maths import intervals_of


@dataclass(frozen=True, kw_only=True, eq=False)
class Whole:
    """What is left of some points: which frames, which points, and their positions without gaps."""

    frames: slice
    points: Int[ndarray, "K"]
    positions: Float[ndarray, "T K 3"]
    repairs: tuple[Repair, ...] = ()


def without_gaps(
    positions: Float[ndarray, "T K 3"], names: Sequence[str], needed: Sequence[str], fps: float, where: str
) -> Whole:
    """Fill what may be filled.

    Args:
        positions: NaN marks a lost sample.
        names: of the K points.
        needed: those that nothing works without; others are left out where they have long gaps.
        fps: frames per second.
        where: the file, for messages.

    Raises:
        ClipError: a needed point is lost for too long in mid-clip, or never seen together with the others.
    """
    lost = ~np.isfinite(positions).all(axis=-1)
    if not lost.any():
        return Whole(frames=slice(None), points=np.arange(len(names)), positions=positions)
    must = np.array([n in set(needed) for n in names])
    together = np.flatnonzero(~lost[:, must].any(axis=1))
    if not len(together):
        gone = [n for n, m, k in zip(names, must, lost.all(axis=0), strict=True) if m and k]
        raise ClipError(
            where, found=f"{', '.join(gone)} never seen" if gone else "no frame in which all needed points are seen",
            expected="all of " + ", ".join(n for n, m in zip(names, must, strict=True) if m),
        )  # fmt: skip
    first, last = int(together[0]), int(together[-1]) + 1
    repairs = []
    if first > 0 or last < len(lost):
        count = first + len(lost) - last
        where_left = f"left are {first / fps:.2f} to {(last - 1) / fps:.2f} s"
        repairs.append(Repair(what="frames left out at the ends, where points are lost", count=count, where=where_left))
    lost = lost[first:last]
    stray = ~must & np.array([_worst(lost[:, k]) > REPAIR.gap_s * fps + 1e-9 for k in range(len(names))])
    for k in np.flatnonzero(must & (lost.sum(axis=0) > REPAIR.gap_s * fps)):
        for a, b in intervals_of(lost[:, k]):
            if b - a > REPAIR.gap_s * fps + 1e-9:
                raise ClipError(
                    f"{where}, point '{names[k]}'",
                    found=f"no data from {(first + a) / fps:.2f} s to {(first + b) / fps:.2f} s",
                    expected=f"gaps of at most {REPAIR.gap_s} s inside the clip",
                    cure="fill it in the capture software, or cut the clip",
                )
    if stray.any():
        left = ", ".join(n for n, s in zip(names, stray, strict=True) if s)
        repairs.append(Repair(what=f"points left out for their gaps ({left})", count=int(stray.sum()), of="points"))
    points = np.flatnonzero(~stray)
    filled, lost = positions[first:last][:, points].copy(), lost[:, points]
    frames = np.arange(len(filled))
    for k in np.flatnonzero(lost.any(axis=0)):
        seen = ~lost[:, k]
        for axis in range(3):
            filled[lost[:, k], k, axis] = np.interp(frames[lost[:, k]], frames[seen], filled[seen, k, axis])
    if lost.any():
        where_filled = f"gaps of at most {REPAIR.gap_s} s, first at {np.argmax(lost.any(axis=1)) / fps:.2f} s"
        repairs.append(
            Repair(what="lost samples filled by interpolation", count=int(lost.sum()), where=where_filled, of="samples")
        )
    return Whole(frames=slice(first, last), points=points, positions=filled, repairs=tuple(repairs))


def _worst(lost: ndarray) -> float:
    """Frames of the longest gap; endless where it reaches an end, from beyond which nothing can be interpolated."""
    runs = intervals_of(lost)
    if any(a == 0 or b == len(lost) for a, b in runs):
        return float("inf")
    return float(max((b - a for a, b in runs), default=0))
