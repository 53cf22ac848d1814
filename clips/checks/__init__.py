"""Whether a recording is a person moving, or a robot: questions with their numbers, and what follows from them."""

from collections.abc import Callable

from clips.checks.body import check_bones, check_facing, knees_ahead
from clips.checks.check import Check
from clips.checks.floor_plane import FloorPlane, check_floor, fit_floor
from clips.checks.foot_points import FootPoints, foot_points
from clips.checks.gravity import check_gravity
from clips.checks.jumps import check_jumps, pose_jumps, pose_steps
from clips.checks.sway import check_sway, likely_rate, sway_ratio
from clips.checks.travel import check_travel
from clips.clip import Clip

CHECKS: tuple[Callable[[Clip], Check], ...] = (
    check_bones,
    check_facing,
    check_jumps,
    check_travel,
    check_floor,
    check_gravity,
    check_sway,
)
"""What is asked of every clip, after it was mended."""


def doubts(clip: Clip) -> list[Check]:
    """The checks that a clip passes, but not as a person would."""
    return [check for check in (question(clip) for question in CHECKS) if check.verdict == "doubtful"]


__all__ = [
    "CHECKS",
    "Check",
    "FloorPlane",
    "FootPoints",
    "check_bones",
    "check_facing",
    "check_floor",
    "check_gravity",
    "check_jumps",
    "check_sway",
    "check_travel",
    "doubts",
    "fit_floor",
    "foot_points",
    "knees_ahead",
    "likely_rate",
    "pose_jumps",
    "pose_steps",
    "sway_ratio",
]
