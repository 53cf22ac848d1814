"""The tracking task: what is seen, rewarded and drawn, when it begins and when it has failed."""

from tracking.task.motion_set import (
    Piece,
    Selection,
    bundle_folder,
    check_together,
    read_piece,
    repertoire_sha256,
    select_pieces,
)
from tracking.task.randomisation import draw_robots
from tracking.task.rewards import beyond_soft_limits, reward_terms
from tracking.task.tracking_errors import compare
from tracking.task.tracking_task import StepResult, TrackingTask

__all__ = [
    "Piece",
    "Selection",
    "StepResult",
    "TrackingTask",
    "beyond_soft_limits",
    "bundle_folder",
    "check_together",
    "compare",
    "draw_robots",
    "read_piece",
    "repertoire_sha256",
    "reward_terms",
    "select_pieces",
]
