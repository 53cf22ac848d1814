"""Learning: PPO on the task, its checkpoints and curves, one process or many, and the export of what was learnt."""

from tracking.run_files import CHECKPOINT, CURVES, LABELS, TEACHER
from tracking.training.actor_export import export_bundle, export_tracker, torch_policy
from tracking.training.actor_import import begin_with
from tracking.training.checkpoint import load_checkpoint
from tracking.training.curves import TensorBoard, write_curves
from tracking.training.distributed import Team
from tracking.training.ppo import Iteration, Trainer, make_algorithm
from tracking.training.run import train
from tracking.training.run_record import Run, nobody_looks, run_folder
from tracking.training.stop_signals import Signals

__all__ = [
    "CHECKPOINT",
    "CURVES",
    "LABELS",
    "TEACHER",
    "Iteration",
    "Run",
    "Signals",
    "Team",
    "TensorBoard",
    "Trainer",
    "begin_with",
    "export_bundle",
    "export_tracker",
    "load_checkpoint",
    "make_algorithm",
    "nobody_looks",
    "run_folder",
    "torch_policy",
    "train",
    "write_curves",
]
