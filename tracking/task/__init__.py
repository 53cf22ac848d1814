"""The tracking task: what is seen, rewarded and drawn, when it begins and when it has failed."""

from tracking.task.motion_set import (
    NamedReference,
    Selection,
    bundle_folder,
    check_motion_set,
    is_floor_work,
    motion_set_sha256,
    read_named_reference,
    select_references,
)
from tracking.task.randomisation import draw_robots
from tracking.task.rehearsal_set import read_rehearsal_set, rehearsal_names, write_rehearsal_set
from tracking.task.rewards import beyond_soft_limits, reward_terms
from tracking.task.symmetry import Symmetry, symmetry_of
from tracking.task.tracking_errors import FALLS, compare
from tracking.task.tracking_task import StepResult, TrackingTask

__all__ = [
    "FALLS",
    "NamedReference",
    "Selection",
    "StepResult",
    "Symmetry",
    "TrackingTask",
    "beyond_soft_limits",
    "bundle_folder",
    "check_motion_set",
    "compare",
    "draw_robots",
    "is_floor_work",
    "motion_set_sha256",
    "read_named_reference",
    "read_rehearsal_set",
    "rehearsal_names",
    "reward_terms",
    "select_references",
    "symmetry_of",
    "write_rehearsal_set",
]
