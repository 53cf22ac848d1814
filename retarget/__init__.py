"""Retargeting: a recorded clip and a robot in, a feasible reference and an honest report out."""

from retarget.config import ContactConfig, Gates, IkConfig, IkWeights, RetargetConfig
from retarget.errors import RetargetError
from retarget.pipeline import Retargeted, retarget
from retarget.report import Metric, Report, measure

__all__ = [
    "ContactConfig",
    "Gates",
    "IkConfig",
    "IkWeights",
    "Metric",
    "Report",
    "RetargetConfig",
    "RetargetError",
    "Retargeted",
    "measure",
    "retarget",
]
