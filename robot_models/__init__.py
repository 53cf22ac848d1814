"""What a robot is: one profile per robot, one loader to a compiled, mesh-free MuJoCo model with names."""

from robot_models.catalogue import DEFAULT_ROBOT, find_profile, installed, load_robot, robot_names
from robot_models.errors import DanceError, RobotError
from robot_models.kinematics import BodyStates, body_states, forward_kinematics, sole_corners, sole_edges
from robot_models.profile import FEET, LANDMARKS, RobotProfile, Sole, read_profile
from robot_models.robot import CONTACT_NAMES, RobotModel

__all__ = [
    "CONTACT_NAMES",
    "DEFAULT_ROBOT",
    "FEET",
    "LANDMARKS",
    "BodyStates",
    "DanceError",
    "RobotError",
    "RobotModel",
    "RobotProfile",
    "Sole",
    "body_states",
    "find_profile",
    "forward_kinematics",
    "installed",
    "load_robot",
    "read_profile",
    "robot_names",
    "sole_corners",
    "sole_edges",
]
