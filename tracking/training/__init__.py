"""Learning: PPO on the task, its checkpoints and curves, one process or many, and the export of what was learnt."""

from tracking.training.actor_export import export_bundle
from tracking.training.checkpoint import load_checkpoint
from tracking.training.focus import Focus, focus, judge_teacher
from tracking.training.ppo import Trainer
from tracking.training.run import train
from tracking.training.run_record import CHECKPOINT, CURVES, Run
from tracking.training.teacher import TeacherTrainer, teacher_actions, teaching_task
from tracking.training.teacher_file import Teacher, load_teacher, restore_teacher, save_teacher
from tracking.training.teaching import teach, teach_tracker

__all__ = [
    "CHECKPOINT",
    "CURVES",
    "Focus",
    "Run",
    "Teacher",
    "TeacherTrainer",
    "Trainer",
    "export_bundle",
    "focus",
    "judge_teacher",
    "load_checkpoint",
    "load_teacher",
    "restore_teacher",
    "save_teacher",
    "teach",
    "teach_tracker",
    "teacher_actions",
    "teaching_task",
    "train",
]
