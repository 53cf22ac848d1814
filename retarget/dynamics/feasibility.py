"""Where a motion is hard for the robot, and why, in words; flights against a thrown body's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from retarget.dynamics.inverse_dynamics import Dynamics
from retarget.rules import GRAVITY
from robot_models.maths import intervals_of


@dataclass(frozen=True, kw_only=True)
class InfeasibleStretch:
    """A stretch of frames that is hard or impossible, and the worst of it."""

    start_s: float
    end_s: float
    score: float
    cause: str  # "force", "moment" or "effort"
    text: str

    def __str__(self) -> str:
        return f"{self.start_s:.2f} to {self.end_s:.2f} s (score {self.score:.1f}): {self.text}"


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A stretch without contact, against a thrown body's."""

    start_s: float  # last frame that may carry force, or the first of all
    end_s: float  # the next one, or the last of all
    off_gravity: float  # RMS difference of the CoM's vertical acceleration from gravity in the air [m/s^2]
    rise: float  # of the CoM over the line between the two frames [m]
    ballistic_rise: float  # g T^2 / 8: what a thrown body does in that time [m]


def _merged(stretches: Sequence[tuple[int, int]], gap: float) -> list[tuple[int, int]]:
    """The same, those nearer to each other than a gap [frames] taken for one."""
    merged: list[tuple[int, int]] = []
    for a, b in stretches:
        near = bool(merged) and a - merged[-1][1] < gap
        merged.append((merged.pop()[0] if near else a, b))
    return merged


def hardest_stretches(
    dynamics: Dynamics, *, above: float = 0.5, gap_s: float = 0.1, most: int = 10
) -> list[InfeasibleStretch]:
    """The stretches whose score is above a threshold, worst first, with the cause in words.

    Args:
        dynamics: of a reference.
        above: threshold of the score.
        gap_s: stretches nearer to each other than this are one [s].
        most: how many to name.
    """
    score, parts = dynamics.score, dynamics.parts
    found = []
    for a, b in _merged(intervals_of(score > above), gap_s * dynamics.fps):
        t = a + int(score[a:b].argmax())
        cause = max(parts, key=lambda k: parts[k][t])
        found.append(
            InfeasibleStretch(
                start_s=a / dynamics.fps, end_s=(b - 1) / dynamics.fps, score=float(score[t]), cause=cause,
                text=f"at {t / dynamics.fps:.2f} s {_in_words(dynamics, t, cause)}",
            )
        )  # fmt: skip
    return sorted(found, key=lambda h: -h.score)[:most]


def _in_words(d: Dynamics, t: int, cause: str) -> str:
    if cause == "effort":
        which, share = d.worst_joint[t], f"{d.effort_share[t]:.2f}"
        return (
            f"{which} need {share} of their motors' torque"
            if " and " in which
            else f"{which} needs {share} of its motor's torque"
        )
    in_contact = int(d.in_contact[t].sum())
    where = f"{in_contact} of {d.in_contact.shape[1]} points touching" if in_contact else "nothing touching the floor"
    if cause == "force":
        amount = np.linalg.norm(d.residual[t, :3]) / d.weight
        return f"{amount:.2f} of the weight is missing, mostly {_direction(d.residual[t, :3])}, with {where}"
    amount = np.linalg.norm(d.residual[t, 3:]) / d.weight
    axis = "turning about the vertical" if np.abs(d.residual[t, 3:]).argmax() == 2 else "tipping"
    out = f" and the ZMP {100.0 * d.zmp_outside[t]:.0f} cm outside them" if d.zmp_outside[t] > 0.0 else ""
    return f"a {axis} moment of the weight times {100.0 * amount:.0f} cm is missing, with {where}{out}"


def _direction(force: ndarray) -> str:
    k = int(np.abs(force).argmax())
    return "horizontally" if k < 2 else "upwards" if force[2] > 0.0 else "downwards"


def flight_fit(dynamics: Dynamics, *, longer_than_s: float = 0.1) -> list[Flight]:
    """Every stretch without contact against a thrown body's.

    Args:
        dynamics: of a reference.
        longer_than_s: shorter stretches are left out [s].
    """
    last = len(dynamics.com_w) - 1
    lift = GRAVITY * dynamics.net_wrench_w[:, 2] / dynamics.weight  # the CoM's vertical acceleration less gravity's
    height, out = dynamics.com_w[:, 2], []
    for a, b in intervals_of(dynamics.flight):
        if (b - a) / dynamics.fps <= longer_than_s:
            continue
        start, end = max(a - 1, 0), min(b, last)
        line = np.linspace(height[start], height[end], end - start + 1)
        out.append(
            Flight(
                start_s=start / dynamics.fps, end_s=end / dynamics.fps,
                off_gravity=float(np.sqrt(np.mean(lift[a:b] ** 2))),
                rise=float((height[start : end + 1] - line).max()),
                ballistic_rise=GRAVITY * ((end - start) / dynamics.fps) ** 2 / 8.0,
            )
        )  # fmt: skip
    return out
