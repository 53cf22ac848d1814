"""A dance's accents: the moments in which hands, feet, head or pelvis come to a stop or turn round.

They are what dance research calls kinematic beats, minima of speed (Li et al. 2021, "AI Choreographer", take those of all
joints' mean speed), but part by part: a hand that stops is seen while the other arm moves on. A foot that stays stops once, when
it lands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip, full_qpos
from robot_models import RobotModel, forward_kinematics, load_robot
from robot_models.maths import smooth

_PARTS = ("pelvis", "head", "left_wrist", "right_wrist", "left_ankle", "right_ankle")
_OF_ROBOT = ("pelvis", "head", "left_wrist", "right_wrist", "left_foot", "right_foot")
_SMOOTH_HZ = 6.0
_LEAST_DROP = 0.15  # of a part's speed that is a stop [m/s]
_STOPPED = 0.1  # share of the drop that is left when it counts as stopped
_TOGETHER_S = 0.04  # parts that stop within it are one accent [s]
_APART_S = 0.15  # between two accents, at least [s]
_STEP_S = 0.005  # of the curve in which they are sought [s]
_LEAST = 0.3  # of the mean strength, below which it is none


@dataclass(frozen=True, kw_only=True, eq=False)
class Accents:
    """Moments, in order, and how strong each is."""

    times_s: Float[ndarray, "A"]  # from the first frame [s]
    strength: Float[ndarray, "A"]  # 1: the mean


def parts_of(clip: Clip) -> Float[ndarray, "T K 3"]:
    """The paths of what can have an accent [m]: pelvis, hands, feet, and the head where there is one."""
    if not isinstance(clip, HumanClip):
        robot = load_robot(clip.robot)
        return robot_parts(robot, full_qpos(clip, robot))
    return np.stack([clip.point(p) for p in _PARTS if p != "head" or p in clip.landmarks], axis=1)


def robot_parts(robot: RobotModel, qpos: Float[ndarray, "T nq"]) -> Float[ndarray, "T K 3"]:
    """The same of a robot's poses, by forward kinematics."""
    names = [p for p in _OF_ROBOT if p in robot.profile.landmarks]
    return robot.landmark_pos(names, *forward_kinematics(robot, qpos))


def find_accents(parts: Float[ndarray, "T K 3"], fps: float) -> Accents:
    """The accents of a dance.

    Args:
        parts: paths of what can have one [m].
        fps: of their frames.
    """
    from scipy.signal import find_peaks

    time = np.arange(0.0, len(parts) / fps, _STEP_S)
    curve = np.zeros(len(time))
    for at_s, drop in _stops(parts, fps):
        curve += np.sqrt(drop) * np.exp(-0.5 * ((time - at_s) / _TOGETHER_S) ** 2)
    peaks, _ = find_peaks(curve, height=1e-3, distance=max(1, round(_APART_S / _STEP_S)))
    strength = curve[peaks] / max(1e-9, curve[peaks].mean()) if len(peaks) else np.zeros(0)
    kept = strength >= _LEAST
    return Accents(times_s=time[peaks[kept]], strength=strength[kept])


def _stops(parts: Float[ndarray, "T K 3"], fps: float) -> list[tuple[float, float]]:
    """When parts come to a stop [s], and what speed they lose by it [m/s]."""
    from scipy.signal import find_peaks

    if len(parts) < 4:
        return []
    out = []
    speeds = np.linalg.norm(smooth(np.gradient(parts, 1.0 / fps, axis=0), fps, _SMOOTH_HZ), axis=2)
    for speed in speeds.T:
        bursts, _ = find_peaks(speed, prominence=_LEAST_DROP)
        for top, end in zip(bursts, np.append(bursts, len(speed))[1:], strict=True):
            fall = speed[top:end]
            lost = float(fall[0] - fall.min())
            still = fall.min() + _STOPPED * lost
            first = int((fall <= still).argmax())
            if fall[first] > _LEAST_DROP and first == len(fall) - 1:
                continue  # cut off in mid-movement
            before, after = fall[first - 1], fall[first]
            at = top + first - (still - after) / max(1e-9, before - after)
            out.append((at / fps, lost))
    return out
