"""A floor that sinks, rises or leans, as cameras see it: fitted to where feet stand, and levelled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, RobotClip
from clips.config import FLOOR
from clips.contact import floor_nearby, heights_and_speeds
from clips.edit.level import between, turned
from clips.provenance import Repair
from robot_models.maths import rotation as rot

_UP = np.array([0.0, 0.0, 1.0])


def on_level_floor(clip: Clip) -> Clip:
    """The clip with its floor level, if standing feet show one that drifts in time or leans in space.

    One plane a + b t + c x + d y is fitted to the heights of standing ankles and toes, each about its own height over the
    sole, robustly (Cauchy loss), since feet also stand still in the air. Robots are left as they are.
    """
    if isinstance(clip, RobotClip) or clip.source.stated("floor"):
        return clip
    points = [clip.point(k) for k in ("left_ankle", "right_ankle", "left_toe", "right_toe") if k in clip.landmarks]
    rows, heights = _standing(np.stack(points, axis=1), clip.fps)
    if len(rows) < FLOOR.samples * rows.shape[1]:
        return clip
    plane = _fit(rows, heights)
    hips = 0.5 * (clip.point("left_hip") + clip.point("right_hip"))
    drift = _terms(np.arange(clip.frames) / clip.fps, hips) @ plane[-3:]
    off_level = heights - _level(rows, heights)
    leaning = heights - rows @ plane
    lean = float(np.hypot(*plane[-2:]))
    unseen = np.ptp(drift) < FLOOR.seen or np.median(np.abs(leaning)) > FLOOR.better * np.median(np.abs(off_level))
    if unseen or lean > FLOOR.most_lean:
        return clip
    # Down by the drift, then turned about a point of the floor under the first frame, so that nothing is bent.
    time = np.arange(clip.frames) / clip.fps
    normal = rot.unit(np.array([-plane[-2], -plane[-1], 1.0]))
    lowered = replace(clip, positions=clip.positions - (plane[-3] * time)[:, None, None] * _UP)
    level = turned(lowered, between(normal, _UP))
    what = f"floor levelled (it drifts by {100 * plane[-3]:.1f} cm/s and leans by {100 * lean:.1f} %)"
    repair = Repair(what=what, count=clip.frames, where=f"{100 * np.ptp(drift):.0f} cm over the clip")
    return replace(level, source=clip.source.mended(repair))


def _terms(time: Float[ndarray, "..."], at: Float[ndarray, "... 3"]) -> Float[ndarray, "... 3"]:
    return np.stack((time, at[..., 0], at[..., 1]), axis=-1)


def _standing(points: Float[ndarray, "T K 3"], fps: float) -> tuple[Float[ndarray, "n C"], Float[ndarray, "n"]]:
    """Rows (one column per point, then time, x, y) and heights of the samples at which a point stands."""
    count = points.shape[1]
    height, speed = heights_and_speeds(points, fps, floor_nearby(points, fps, FLOOR.nearby_s))
    frame, point = np.nonzero(FLOOR.standing.holds(height, speed))
    own = np.eye(count)[point]
    rows = np.concatenate((own, _terms(frame / fps, points[frame, point])), axis=1)
    return rows[:, [*np.flatnonzero(own.any(axis=0)), count, count + 1, count + 2]], points[frame, point, 2]


def _fit(rows: Float[ndarray, "n C"], heights: Float[ndarray, "n"]) -> Float[ndarray, "C"]:
    from scipy.optimize import least_squares

    begin = np.append([np.median(heights[rows[:, k] > 0.5]) for k in range(rows.shape[1] - 3)], np.zeros(3))

    def miss(plane: ndarray) -> ndarray:
        return np.asarray(rows @ plane - heights)

    def slope(_plane: ndarray) -> ndarray:
        return rows

    plane = begin
    for noise in FLOOR.noise:
        plane = least_squares(miss, plane, slope, loss="cauchy", f_scale=noise).x
    return np.asarray(plane)


def _level(rows: Float[ndarray, "n C"], heights: Float[ndarray, "n"]) -> Float[ndarray, "n"]:
    """The same for a level floor: each point at its median height."""
    own = rows[:, :-3] > 0.5
    return np.asarray(rows[:, :-3] @ np.array([np.median(heights[k]) for k in own.T]))
