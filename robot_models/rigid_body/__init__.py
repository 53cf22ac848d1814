"""Where a robot's bodies are, how they move with its coordinates, and their momentum: whole clips at once."""

from robot_models.rigid_body.jacobians import Kinematics, ancestors, forces, integrate, kinematics, moved, tangents
from robot_models.rigid_body.kinematics import (
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
from robot_models.rigid_body.momentum import Momentum, momentum, skew
from robot_models.rigid_body.pinocchio_model import pinocchio_model, pinocchio_q, pinocchio_v, urdf_link, urdf_text

__all__ = [
    "AXIAL",
    "POLAR",
    "BodyStates",
    "Kinematics",
    "Momentum",
    "Reflection",
    "ancestors",
    "body_states",
    "forces",
    "forward_kinematics",
    "heel_toe_positions",
    "integrate",
    "joint_axes",
    "kinematics",
    "leg_length",
    "momentum",
    "moved",
    "other_side",
    "pinocchio_model",
    "pinocchio_q",
    "pinocchio_v",
    "reflected_joints",
    "skew",
    "sole_corners",
    "tangents",
    "urdf_link",
    "urdf_text",
]
