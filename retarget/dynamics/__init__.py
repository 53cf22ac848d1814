"""Whether physics allows a motion: inverse dynamics, contact forces within friction, and where and why it does not."""

from retarget.dynamics.feasibility import flight_fit, hardest_stretches
from retarget.dynamics.inverse_dynamics import Dynamics, dynamics_of, torque_misfit

__all__ = [
    "Dynamics",
    "dynamics_of",
    "flight_fit",
    "hardest_stretches",
    "torque_misfit",
]
