"""The whole-clip solver: all frames as one least-squares problem within joint limits and clearances."""

from retarget.solver.objective import make_objective
from retarget.solver.whole_clip import coarse_poses, make_possible, optimise

__all__ = [
    "coarse_poses",
    "make_objective",
    "make_possible",
    "optimise",
]
