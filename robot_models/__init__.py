"""What a robot is: one profile per robot, one loader to a compiled, mesh-free MuJoCo model with names."""

from robot_models.build import BODY_BIT
from robot_models.catalogue import DEFAULT_ROBOT, find_profile, installed, load_robot, robot_names
from robot_models.errors import DanceError, RobotError, import_or_refuse
from robot_models.geometry import SelfCollisions, body_geoms, lowest_point, lowest_points, self_collisions
from robot_models.jacobians import Kinematics, ancestors, forces, integrate, kinematics, moved
from robot_models.kinematics import (
    AXIAL,
    POLAR,
    BodyStates,
    Reflection,
    body_states,
    forward_kinematics,
    heel_toe_positions,
    joint_axes,
    leg_length,
    other_side,
    reflected_joints,
    sole_corners,
)
from robot_models.model import CONTACT_NAMES, RobotModel
from robot_models.pinocchio_model import pinocchio_model, pinocchio_q, pinocchio_v, urdf_text
from robot_models.profile import FEET, LANDMARKS, RobotProfile, Sole, expand_patterns, read_profile
from robot_models.version import __version__
from robot_models.visual import Part, draw_off_screen, visual_parts

__all__ = [
    "AXIAL",
    "BODY_BIT",
    "CONTACT_NAMES",
    "DEFAULT_ROBOT",
    "FEET",
    "LANDMARKS",
    "POLAR",
    "BodyStates",
    "DanceError",
    "Kinematics",
    "Part",
    "Reflection",
    "RobotError",
    "RobotModel",
    "RobotProfile",
    "SelfCollisions",
    "Sole",
    "__version__",
    "ancestors",
    "body_geoms",
    "body_states",
    "draw_off_screen",
    "expand_patterns",
    "find_profile",
    "forces",
    "forward_kinematics",
    "heel_toe_positions",
    "import_or_refuse",
    "installed",
    "integrate",
    "joint_axes",
    "kinematics",
    "leg_length",
    "load_robot",
    "lowest_point",
    "lowest_points",
    "moved",
    "other_side",
    "pinocchio_model",
    "pinocchio_q",
    "pinocchio_v",
    "read_profile",
    "reflected_joints",
    "robot_names",
    "self_collisions",
    "sole_corners",
    "urdf_text",
    "visual_parts",
]
