"""Whether physics allows a motion: inverse dynamics, contact forces within friction, and where and why it does not."""

from retarget.dynamics.contact_forces import PER_WEIGHT, ForceCone, carrying_joints, force_cone
from retarget.dynamics.feasibility import flight_fit, hardest_stretches
from retarget.dynamics.floor_points import FloorPoints, carrying_parts, carrying_points
from retarget.dynamics.gliding import gliding_edges
from retarget.dynamics.inverse_dynamics import Dynamics, dynamics_of, torque_misfit
from retarget.dynamics.momentum_rate import MomentumRate, momentum_rate

__all__ = [
    "PER_WEIGHT",
    "Dynamics",
    "FloorPoints",
    "ForceCone",
    "MomentumRate",
    "carrying_joints",
    "carrying_parts",
    "carrying_points",
    "dynamics_of",
    "flight_fit",
    "force_cone",
    "gliding_edges",
    "hardest_stretches",
    "momentum_rate",
    "torque_misfit",
]
