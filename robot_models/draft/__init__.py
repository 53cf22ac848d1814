"""A profile for a robot that nobody prepared: its limbs, soles and capsules found, its numbers estimated."""

from robot_models.draft.collections import Listed, in_collection, listed_robot, menagerie_humanoids
from robot_models.draft.profile_text import draft_profile, without_overlaps
from robot_models.draft.skeleton_tree import SkeletonTree
from robot_models.draft.trial import STANDS_S, standing_seconds

__all__ = [
    "STANDS_S",
    "Listed",
    "SkeletonTree",
    "draft_profile",
    "in_collection",
    "listed_robot",
    "menagerie_humanoids",
    "standing_seconds",
    "without_overlaps",
]
