"""What numbers mean: which joint, which order, which axis and unit, which part of the body; each with its evidence."""

from clips.identify.human import human_clip
from clips.identify.joint_layout import breadth_first, choose_layout, joint_order
from clips.identify.landmark_names import find_landmarks
from clips.identify.mapping import MappingNeededError, UnknownSkeletonError
from clips.identify.robot import robot_clip

__all__ = [
    "MappingNeededError",
    "UnknownSkeletonError",
    "breadth_first",
    "choose_layout",
    "find_landmarks",
    "human_clip",
    "joint_order",
    "robot_clip",
]
