"""A teacher on disk, `teacher.pt`: networks, optimiser and statistics, so that its own optimisation can go on."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from clips import write_whole
from robot_models import RobotModel
from tracking.errors import TrackingError
from tracking.training.teacher import TeacherTrainer

FORMAT_VERSION = 1


@dataclass(frozen=True, kw_only=True)
class Teacher:
    """A teacher as it was read."""

    robot: str
    robot_hash: str
    rows: tuple[str, ...]  # what it sees, in order
    steps: int  # control steps that it has learnt for
    state: dict[str, Any]  # of the algorithm


def save_teacher(path: Path, trainer: TeacherTrainer, steps: int, *, optimiser: bool = True) -> None:
    """Write a teacher, whole or not at all; without its optimiser it is a third of the size, and can only be played."""
    task, state = trainer.task, trainer.algorithm.save()
    if not optimiser:
        state = {"actor_state_dict": state["actor_state_dict"]}
    told = {
        "format_version": FORMAT_VERSION,
        "robot": task.robot.name,
        "robot_hash": task.robot.hash,
        "rows": json.dumps(_rows(trainer)),
        "steps": steps,
        "config": json.dumps(asdict(trainer.teacher), sort_keys=True),
        "algorithm": state,
    }
    with write_whole(path) as stream:
        torch.save(told, stream)


def load_teacher(path: Path) -> Teacher:
    """Read a teacher; only tensors and plain values are unpickled.

    Raises:
        TrackingError: no such file, no teacher, or another version.
    """
    try:
        told: dict[str, Any] = torch.load(path, weights_only=True, map_location="cpu")
        version = told["format_version"] if "rows" in told else None
    except FileNotFoundError as e:
        raise TrackingError(str(path), found="no such file", expected="a teacher") from e
    except Exception as e:  # torch raises a different type for every way in which a file can be broken
        raise TrackingError(str(path), found=f"a file that is no teacher ({type(e).__name__})", expected="one") from e
    if version != FORMAT_VERSION:
        raise TrackingError(str(path), found="another format", expected=f"teacher version {FORMAT_VERSION}")
    return Teacher(
        robot=told["robot"], robot_hash=told["robot_hash"], rows=tuple(json.loads(told["rows"])), steps=told["steps"],
        state=told["algorithm"],
    )  # fmt: skip


def restore_teacher(trainer: TeacherTrainer, teacher: Teacher, robot: RobotModel) -> None:
    """Let a trainer go on from a teacher; without a critic in it, only its actor is taken.

    Raises:
        TrackingError: another robot's, or one that sees other things.
    """
    if (teacher.robot, teacher.robot_hash) != (robot.name, robot.hash):
        raise TrackingError("teacher", found=f"one of {teacher.robot}", expected=f"{robot.name} as it is now")
    if list(teacher.rows) != _rows(trainer):
        raise TrackingError("teacher", found="one that sees other things than this release's", expected="the same rows")
    whole = "critic_state_dict" in teacher.state
    trainer.algorithm.load(teacher.state, None if whole else {"actor": True}, strict=True)


def _rows(trainer: TeacherTrainer) -> list[str]:
    return [f"{row.name} {row.size}" for row in (*trainer.task.actor.rows, *trainer.task.teacher.rows)]
