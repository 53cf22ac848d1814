"""What numbers mean: which joint, which order, which axis and unit, which part of the body; each with its evidence."""

from clips.identify.human import human_clip
from clips.identify.joint_space import breadth_first, choose_layout, full_qpos, joint_order, robot_clip
from clips.identify.landmark_names import find_landmarks
from clips.identify.mapping import UnknownSkeleton

__all__ = [
    "UnknownSkeleton",
    "breadth_first",
    "choose_layout",
    "find_landmarks",
    "full_qpos",
    "human_clip",
    "joint_order",
    "robot_clip",
]
