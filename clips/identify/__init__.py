"""What numbers mean: which joint, which order, which axis and unit, which part of the body; each with its evidence."""

from clips.identify.consistency import (
    MOST_MISFIT,
    check_against_bodies,
    check_against_velocities,
    misfit,
    order_that_fits,
)
from clips.identify.human import human_clip
from clips.identify.joint_layout import breadth_first, choose_layout, joint_order, joints_by_name
from clips.identify.landmark_names import find_landmarks
from clips.identify.mapping import MappingNeededError, UnknownSkeletonError
from clips.identify.robot import robot_clip

__all__ = [
    "MOST_MISFIT",
    "MappingNeededError",
    "UnknownSkeletonError",
    "breadth_first",
    "check_against_bodies",
    "check_against_velocities",
    "choose_layout",
    "find_landmarks",
    "human_clip",
    "joint_order",
    "joints_by_name",
    "misfit",
    "order_that_fits",
    "robot_clip",
]
