"""Whether a recording is a person moving, or a robot: questions with their numbers, and what follows from them."""

from collections.abc import Callable

from clips.checks.check import Check
from clips.checks.foot_points import FootPoints, foot_points
from clips.checks.travel import check_travel
from clips.clip import Clip

CHECKS: tuple[Callable[[Clip], Check], ...] = (check_travel,)
"""What is asked of every clip, after it was mended."""

__all__ = ["CHECKS", "Check", "FootPoints", "check_travel", "foot_points"]
