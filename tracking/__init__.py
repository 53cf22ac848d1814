"""Tracking: a reference in, a trained, evaluated and exported policy out.

The names are looked up when they are first used: torch and Gymnasium are heavy, and optional.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tracking.config import PpoConfig, RandomisationConfig, RewardConfig, TaskConfig, TerminationConfig, TrainConfig
from tracking.errors import TrackingError
from tracking.policy import Contract, read_contract

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
        Measurement,
        Motion,
        Runner,
        check_contract,
        load_bundle,
        motion_of,
        onnx_policy,
        read_golden,
        replay,
    )
    from tracking.task import TrackingTask
    from tracking.training import Run, export_bundle, train

_HOME = {
    **dict.fromkeys(("ENGINES", "engine_names"), "tracking.engines.registry"),
    **dict.fromkeys(("read_golden", "replay"), "tracking.policy.golden_trace"),
    **dict.fromkeys(("Cell", "sweep"), "tracking.evaluation.condition_sweep"),
    "Bundle": "tracking.policy.bundle",
    "load_bundle": "tracking.policy.bundle",
    "DanceEnv": "tracking.envs.dance_env",
    "Evaluation": "tracking.evaluation.rollouts",
    "evaluate": "tracking.evaluation.rollouts",
    "evaluation_task": "tracking.evaluation.rollouts",
    "check_contract": "tracking.policy.bundle",
    "export_bundle": "tracking.training.actor_export",
    **dict.fromkeys(("play", "start"), "tracking.evaluation.rollouts"),
    "DanceTrackingEnv": "tracking.envs.tracking_env",
    "ReferenceCheck": "tracking.evaluation.reference_check",
    "check_reference": "tracking.evaluation.reference_check",
    **dict.fromkeys(("Measurement", "Motion", "Runner", "motion_of", "onnx_policy"), "tracking.policy.runner"),
    "TrackingTask": "tracking.task.tracking_task",
    "Run": "tracking.training.run",
    "train": "tracking.training.run",
}

__all__ = [
    "ENGINES",
    "Bundle",
    "Cell",
    "Contract",
    "DanceEnv",
    "DanceTrackingEnv",
    "Evaluation",
    "Measurement",
    "Motion",
    "PpoConfig",
    "RandomisationConfig",
    "ReferenceCheck",
    "RewardConfig",
    "Run",
    "Runner",
    "TaskConfig",
    "TerminationConfig",
    "TrackingError",
    "TrackingTask",
    "TrainConfig",
    "check_contract",
    "check_reference",
    "engine_names",
    "evaluate",
    "evaluation_task",
    "export_bundle",
    "load_bundle",
    "motion_of",
    "onnx_policy",
    "play",
    "read_contract",
    "read_golden",
    "replay",
    "start",
    "sweep",
    "train",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tracking' has no attribute '{name}'")
    try:
        return getattr(import_module(_HOME[name]), name)
    except ModuleNotFoundError as e:
        raise TrackingError(
            f"tracking.{name}", found=f"no package {e.name}", expected="the training extra",
            cure="pip install 'dance-retarget[train]'",
        ) from e  # fmt: skip
