"""What numbers mean: which joint, which order, which axis and unit, which part of the body; each with its evidence."""

from clips.identify.consistency import NamedMotion, check_against_bodies, check_against_velocities, in_root
from clips.identify.human import human_clip
from clips.identify.joint_layout import NamelessMotion, breadth_first, choose_layout, joint_order, joints_by_name
from clips.identify.landmark_names import find_landmarks
from clips.identify.mapping import MappingNeededError, UnknownSkeletonError
from clips.identify.point_layout import LAYOUTS, PointLayout, point_layout
from clips.identify.robot import robot_clip

__all__ = [
    "LAYOUTS",
    "MappingNeededError",
    "NamedMotion",
    "NamelessMotion",
    "PointLayout",
    "UnknownSkeletonError",
    "breadth_first",
    "check_against_bodies",
    "check_against_velocities",
    "choose_layout",
    "find_landmarks",
    "human_clip",
    "in_root",
    "joint_order",
    "joints_by_name",
    "point_layout",
    "robot_clip",
]
