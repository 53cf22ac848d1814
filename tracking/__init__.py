"""Tracking: a reference in, a trained, evaluated and exported policy out.

The names are looked up when they are first used: torch and Gymnasium are heavy, and optional.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from robot_models import __version__
from tracking.config import (
    DistillationConfig,
    FocusConfig,
    PpoConfig,
    RandomisationConfig,
    RewardConfig,
    TaskConfig,
    TeacherConfig,
    TerminationConfig,
    TrainConfig,
)
from tracking.errors import TrackingError

if TYPE_CHECKING:
    from tracking.engines import ENGINES, engine_names
    from tracking.envs import DanceEnv, DanceTrackingEnv
    from tracking.evaluation import (
        Cell,
        Evaluation,
        ReferenceCheck,
        check_reference,
        evaluate,
        evaluation_task,
        play,
        start,
        sweep,
    )
    from tracking.policy import (
        Bundle,
        Contract,
        Measurement,
        Motion,
        Runner,
        check_contract,
        load_bundle,
        motion_of,
        onnx_policy,
        read_contract,
        read_golden,
        replay,
    )
    from tracking.run_files import (
        AUTO,
        LABELS,
        NOBODY,
        REHEARSAL,
        named_teacher,
        refuse_missing_run,
        refuse_run_that_is_there,
    )
    from tracking.task import TrackingTask
    from tracking.teaching import teach
    from tracking.training import Run, export_bundle, train

_ROOMS = {
    "engines": ("ENGINES", "engine_names"),
    "envs": ("DanceEnv", "DanceTrackingEnv"),
    "evaluation": (
        "Cell", "Evaluation", "ReferenceCheck", "check_reference", "evaluate", "evaluation_task", "play", "start", "sweep",
    ),
    "policy": (
        "Bundle", "Contract", "Measurement", "Motion", "Runner", "check_contract", "load_bundle", "motion_of", "onnx_policy",
        "read_contract", "read_golden", "replay",
    ),
    "run_files": ("AUTO", "LABELS", "NOBODY", "REHEARSAL", "named_teacher", "refuse_missing_run", "refuse_run_that_is_there"),
    "task": ("TrackingTask",),
    "teaching": ("teach",),
    "training": ("Run", "export_bundle", "train"),
}  # fmt: skip
_ROOM_OF = {name: room for room, names in _ROOMS.items() for name in names}

__all__ = [
    "AUTO",
    "ENGINES",
    "LABELS",
    "NOBODY",
    "REHEARSAL",
    "Bundle",
    "Cell",
    "Contract",
    "DanceEnv",
    "DanceTrackingEnv",
    "DistillationConfig",
    "Evaluation",
    "FocusConfig",
    "Measurement",
    "Motion",
    "PpoConfig",
    "RandomisationConfig",
    "ReferenceCheck",
    "RewardConfig",
    "Run",
    "Runner",
    "TaskConfig",
    "TeacherConfig",
    "TerminationConfig",
    "TrackingError",
    "TrackingTask",
    "TrainConfig",
    "__version__",
    "check_contract",
    "check_reference",
    "engine_names",
    "evaluate",
    "evaluation_task",
    "export_bundle",
    "load_bundle",
    "motion_of",
    "named_teacher",
    "onnx_policy",
    "play",
    "read_contract",
    "read_golden",
    "refuse_missing_run",
    "refuse_run_that_is_there",
    "replay",
    "start",
    "sweep",
    "teach",
    "train",
]


def __getattr__(name: str) -> Any:
    if name not in _ROOM_OF:
        raise AttributeError(f"module 'tracking' has no attribute '{name}'")
    try:
        return getattr(import_module(f"tracking.{_ROOM_OF[name]}"), name)
    except ModuleNotFoundError as e:
        raise TrackingError(
            f"tracking.{name}", found=f"no package {e.name}", expected="the training extra",
            cure="pip install 'dance-retarget[train]'",
        ) from e  # fmt: skip
