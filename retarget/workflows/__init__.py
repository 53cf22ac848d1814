"""Retargeting more than once: several dances as one, slower where physics asks for it, folders of clips."""

from retarget.workflows.as_it_stands import as_it_stands
from retarget.workflows.batch import (
    SUFFIXES,
    BatchConfig,
    Job,
    Outcome,
    jobs_for,
    motion_files,
    run_batch,
    summary_rows,
)
from retarget.workflows.ray_cluster import run_on_ray
from retarget.workflows.robot_check import check_robot
from retarget.workflows.sequence import Transition, retarget_sequence
from retarget.workflows.time_scaling import FitConfig, fit_to_dynamics
from retarget.workflows.to_music import retarget_to_music

__all__ = [
    "SUFFIXES",
    "BatchConfig",
    "FitConfig",
    "Job",
    "Outcome",
    "Transition",
    "as_it_stands",
    "check_robot",
    "fit_to_dynamics",
    "jobs_for",
    "motion_files",
    "retarget_sequence",
    "retarget_to_music",
    "run_batch",
    "run_on_ray",
    "summary_rows",
]
