"""What the robot shall reach: the source's contacts, and its body and feet in the robot's proportions."""

from retarget.targets.ballistic_jumps import raise_jumps
from retarget.targets.contacts import Contacts, body_up, find_contacts, foot_yaw_rate, heel_toe_points, soles_down
from retarget.targets.edits import (
    ContactEdit,
    KeyFrame,
    apply_edits,
    pin_angles,
    read_contacts,
    read_keys,
    write_contacts,
)
from retarget.targets.feet import FootTargets, contact_share, smoothstep
from retarget.targets.floor_parts import floor_parts, landmark_of
from retarget.targets.halves import join_halves, with_standing_legs
from retarget.targets.leads import MotionWithLeads, add_leads, blend_frames, targets_of
from retarget.targets.robot_figure import as_figure, mirrored, of_this_robot, posture_of
from retarget.targets.segment_frames import hand_frames
from retarget.targets.targets import LIMBS, Targets, join, make_targets

__all__ = [
    "LIMBS",
    "ContactEdit",
    "Contacts",
    "FootTargets",
    "KeyFrame",
    "MotionWithLeads",
    "Targets",
    "add_leads",
    "apply_edits",
    "as_figure",
    "blend_frames",
    "body_up",
    "contact_share",
    "find_contacts",
    "floor_parts",
    "foot_yaw_rate",
    "hand_frames",
    "heel_toe_points",
    "join",
    "join_halves",
    "landmark_of",
    "make_targets",
    "mirrored",
    "of_this_robot",
    "pin_angles",
    "posture_of",
    "raise_jumps",
    "read_contacts",
    "read_keys",
    "smoothstep",
    "soles_down",
    "targets_of",
    "with_standing_legs",
    "write_contacts",
]
