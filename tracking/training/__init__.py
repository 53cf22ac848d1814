"""Learning: PPO on the task, its checkpoints and curves, one process or many, and the export of what was learnt."""

from tracking.training.actor_export import export_bundle
from tracking.training.checkpoint import load_checkpoint
from tracking.training.ppo import Trainer
from tracking.training.run import CHECKPOINT, CURVES, Run, train

__all__ = [
    "CHECKPOINT",
    "CURVES",
    "Run",
    "Trainer",
    "export_bundle",
    "load_checkpoint",
    "train",
]
