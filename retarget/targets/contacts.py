"""When the source's feet touch the floor: heel and toe of each foot, with hysteresis, in metres and seconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import FREE, PIVOTING, PLANTED, HumanClip, heights_and_speeds, own_floor
from retarget.config import ContactConfig
from robot_models import FEET, PART_NAMES
from robot_models.maths import close_gaps, intervals_of, rotation

UNSTATED = -1
_LEVEL_SHIN = 0.2  # sine of its angle over the horizontal: 12 degrees


@dataclass(frozen=True, kw_only=True, eq=False)
class Contacts:
    """Touching edges of the source. Columns are left heel, left toe, right heel, right toe."""

    in_contact: Bool[ndarray, "T 4"]
    pivoting: Bool[ndarray, "T 2"]  # per foot: touching and turning faster than a planted foot would
    stated: Int[ndarray, "T 4"]  # what the user says each edge does; UNSTATED where nothing
    stated_parts: Int[ndarray, "T P"]  # the same of the parts of PART_NAMES

    @property
    def labels(self) -> Int[ndarray, "T 4"]:
        """FREE, PLANTED or PIVOTING per edge."""
        pivot = np.repeat(self.pivoting, 2, axis=1)
        return np.where(self.in_contact, np.where(pivot, PIVOTING, PLANTED), FREE)


def find_contacts(clip: HumanClip, config: ContactConfig) -> Contacts:
    """Detect touches on the clip's own ankle and toe points (the ankle stands for the heel)."""
    points = heel_toe_points(clip)
    height, speed = heights_and_speeds(points, clip.fps, own_floor(points, config.floor_percentile))
    tight, loose = config.tight.holds(height, speed), config.loose.holds(height, speed)
    shortest = max(1, round(config.min_duration_s * clip.fps))
    in_contact = np.stack([_hysteresis(tight[:, k], loose[:, k], shortest) for k in range(4)], axis=1)
    in_contact &= np.repeat(soles_down(clip), 2, axis=1)
    turning: ndarray = np.greater(np.abs(foot_yaw_rate(clip)), config.pivot_rate)
    both = np.asarray(in_contact.reshape(-1, 2, 2).any(axis=2))
    return Contacts(
        in_contact=in_contact,
        pivoting=np.stack([close_gaps(turning[:, s] & both[:, s], shortest) for s in range(2)], axis=1) & both,
        stated=np.full(in_contact.shape, UNSTATED),
        stated_parts=np.full((clip.frames, len(PART_NAMES)), UNSTATED),
    )


def heel_toe_points(clip: HumanClip) -> Float[ndarray, "T 4 3"]:
    """Ankle and toe of each foot [m]; the ankle again where the clip has no toe."""
    columns = []
    for side in FEET:
        columns += [
            clip.point(f"{side}_ankle"),
            clip.point(f"{side}_toe" if f"{side}_toe" in clip.landmarks else f"{side}_ankle"),
        ]
    return np.stack(columns, axis=1)


def soles_down(clip: HumanClip) -> Bool[ndarray, "T 2"]:
    """Whether each foot can stand: not with its shin level, as of one who kneels or lies, whose feet lie on the floor too."""
    return np.stack([_rise(clip, side) > _LEVEL_SHIN for side in FEET], axis=1)


def body_up(clip: HumanClip, above: float) -> Bool[ndarray, "T"]:
    """Frames in which nothing but the feet is nearer to their floor than that [m]: nobody sits, kneels or lies."""
    others = {name for name in clip.landmarks if not name.endswith(("ankle", "toe"))} | {"pelvis"}
    lowest = np.min([clip.point(name)[:, 2] for name in others], axis=0)
    return np.asarray(lowest > own_floor(heel_toe_points(clip)).min() + above)


def _rise(clip: HumanClip, side: str) -> Float[ndarray, "T"]:
    """Sine of a shin's angle over the horizontal, from ankle to knee."""
    return rotation.unit(clip.point(f"{side}_knee") - clip.point(f"{side}_ankle"))[:, 2]


def foot_yaw_rate(clip: HumanClip) -> Float[ndarray, "T 2"]:
    """Yaw rate of the ankle-to-toe direction per foot [rad/s]; 0 where the foot points up or down."""
    points = heel_toe_points(clip).reshape(-1, 2, 2, 3)
    along = points[:, :, 1] - points[:, :, 0]
    flat = np.linalg.norm(along[..., :2], axis=-1) > 0.5 * np.linalg.norm(along, axis=-1)
    yaw = np.unwrap(np.arctan2(along[..., 1], along[..., 0]), axis=0)
    return np.where(flat, rotation.linear_velocity(yaw, 1.0 / clip.fps), 0.0)


def _hysteresis(tight: ndarray, loose: ndarray, shortest: int) -> ndarray:
    """Runs of `loose` that hold at least `shortest` frames of `tight`; short holes closed first."""
    loose = close_gaps(loose, shortest)
    out = np.zeros(len(loose), dtype=bool)
    for a, b in intervals_of(loose):
        hits = np.flatnonzero(tight[a:b])
        if len(hits) >= shortest:
            out[a:b] = True
    return out
