"""The whole-clip solver: all frames as one least-squares problem within joint limits and clearances."""

from retarget.solver.objective import make_objective
from retarget.solver.whole_clip import optimise, rough_poses

__all__ = [
    "make_objective",
    "optimise",
    "rough_poses",
]
