"""Who teaches: a tracker by path or by name, what advises a pupil of it, and how well it dances untaught."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from robot_models import RobotModel
from tracking.config import TrainConfig
from tracking.evaluation import Evaluation, evaluate, evaluation_task
from tracking.policy import CONTRACT, SHIPPED, read_runner, read_tracker, with_gains
from tracking.run_files import AUTO, NOBODY, TEACHER, named_teacher
from tracking.task import NamedReference, TrackingTask
from tracking.teaching.adviser import Adviser, TeacherAdviser, TrackerAdviser
from tracking.teaching.teacher_file import load_teacher, teacher_actor


def find_teacher(asked: str, robot: str, control_dt: float) -> Path | None:
    """Who teaches: a file, a tracker that comes with the package by its name, or nobody.

    Args:
        asked: a path; a name, as tracker-g1; "auto", the robot's own where the package has one of that rate; "none".
        robot: name of the robot.
        control_dt: control period of the dances [s].

    Raises:
        TrackingError: there is no such teacher.
    """
    if asked == NOBODY:
        return None
    if asked == AUTO:
        own = SHIPPED / f"tracker-{robot}" / TEACHER
        return own if own.is_file() and load_teacher(own).control_dt == control_dt else None
    return named_teacher(asked)


def adviser_of(
    teacher: Path, robot: RobotModel, pieces: Sequence[NamedReference]
) -> tuple[RobotModel, Callable[[TrackingTask], Adviser]]:
    """The robot with the teacher's gains, and what makes an adviser for a task of it."""
    if teacher.suffix == ".onnx":
        runners = [read_tracker(teacher, robot, piece.reference) for piece in pieces]
        return with_gains(robot, runners[0].contract), lambda task: TrackerAdviser(runners, task)
    told = load_teacher(teacher)
    return robot, lambda task: TeacherAdviser(teacher_actor(told, task), task)


def judge_tracker(
    teacher: Path, robot: RobotModel, pieces: Sequence[NamedReference], config: TrainConfig, rollouts: int = 20
) -> dict[str, Evaluation]:
    """How well a tracker dances references that nobody taught it; {} of a teacher without a tracker beside it."""
    found = {}
    for piece in pieces:
        if teacher.suffix == ".onnx":
            runner = read_tracker(teacher, robot, piece.reference)
        elif (teacher.parent / CONTRACT).is_file():
            runner = read_runner(teacher.parent, piece.path)[1]
        else:
            break
        found[piece.name] = evaluate(
            runner, with_gains(robot, runner.contract), piece.reference, evaluation_task(config.task), rollouts=rollouts,
            seed=config.seed + 900, threads=config.threads,
        )  # fmt: skip
    return found
