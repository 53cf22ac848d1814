"""Whether physics allows a motion: inverse dynamics, contact forces within friction, and where and why it does not."""

from retarget.dynamics.contact_forces import PER_WEIGHT, ForceCone, force_cone, leg_joints
from retarget.dynamics.feasibility import flight_fit, hardest_stretches
from retarget.dynamics.gliding import gliding_edges
from retarget.dynamics.inverse_dynamics import Dynamics, dynamics_of, torque_misfit
from retarget.dynamics.momentum_rate import MomentumRate, momentum_rate
from retarget.dynamics.support import SolePoints, carrying_points, layout_of, placed_points

__all__ = [
    "PER_WEIGHT",
    "Dynamics",
    "ForceCone",
    "MomentumRate",
    "SolePoints",
    "carrying_points",
    "dynamics_of",
    "flight_fit",
    "force_cone",
    "gliding_edges",
    "hardest_stretches",
    "layout_of",
    "leg_joints",
    "momentum_rate",
    "placed_points",
    "torque_misfit",
]
