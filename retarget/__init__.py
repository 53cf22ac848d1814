"""Retargeting: a recorded clip and a robot in, a feasible reference and an honest report out."""

from retarget.config import ContactConfig, IkConfig, ObjectiveWeights, RetargetConfig, WholeClipConfig
from retarget.dynamics import Dynamics, dynamics_of, flight_fit, hardest_stretches
from retarget.errors import RetargetError
from retarget.pipeline import Retargeted, retarget
from retarget.report import Cure, Diagnosis, Metric, Report, Where, diagnose, limb_angles, measure
from retarget.rules import Gates
from retarget.targets import ContactEdit, KeyFrame, read_contacts, read_keys, write_contacts
from retarget.workflows import (
    FitConfig,
    Transition,
    as_it_stands,
    fit_to_dynamics,
    retarget_sequence,
    retarget_to_music,
)
from robot_models import __version__

__all__ = [
    "ContactConfig",
    "ContactEdit",
    "Cure",
    "Diagnosis",
    "Dynamics",
    "FitConfig",
    "Gates",
    "IkConfig",
    "KeyFrame",
    "Metric",
    "ObjectiveWeights",
    "Report",
    "RetargetConfig",
    "RetargetError",
    "Retargeted",
    "Transition",
    "Where",
    "WholeClipConfig",
    "__version__",
    "as_it_stands",
    "diagnose",
    "dynamics_of",
    "fit_to_dynamics",
    "flight_fit",
    "hardest_stretches",
    "limb_angles",
    "measure",
    "read_contacts",
    "read_keys",
    "retarget",
    "retarget_sequence",
    "retarget_to_music",
    "write_contacts",
]
