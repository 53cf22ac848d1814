"""A profile for a robot that nobody prepared: its limbs, soles and capsules found, its numbers estimated."""

from robot_models.draft.profile_text import draft_profile, without_overlaps
from robot_models.draft.skeleton_tree import Branches

__all__ = [
    "Branches",
    "draft_profile",
    "without_overlaps",
]
