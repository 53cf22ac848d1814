"""A dance taught by a tracker, without a reward: `train` for who has a teacher, in minutes where PPO takes hours."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np

from robot_models import RobotModel
from robot_models.maths import Progress, silent
from tracking.config import TrainConfig
from tracking.errors import TrackingError
from tracking.policy import SHIPPED
from tracking.run_files import REHEARSAL
from tracking.task import NamedReference, bundle_folder, read_rehearsal_set
from tracking.teaching.distillation import Distillation
from tracking.teaching.focus import Focus, focus
from tracking.teaching.lesson import as_pupils_see, begin_lesson, make_lesson
from tracking.teaching.lesson_file import restore_lesson, save_lesson
from tracking.teaching.teacher import TeacherTrainer, teaching_task
from tracking.teaching.teacher_file import load_teacher, restore_teacher, save_teacher
from tracking.training import (
    CHECKPOINT,
    LABELS,
    TEACHER,
    Run,
    Signals,
    TensorBoard,
    export_bundle,
    export_tracker,
    nobody_looks,
    run_folder,
    torch_policy,
)

_SAVE_EVERY = 100_000  # labels between two checkpoints, at most: a minute or two; counted, so that runs repeat


def teach(
    robot: RobotModel,
    pieces: Sequence[NamedReference],
    folder: Path,
    teacher: Path,
    config: TrainConfig,
    *,
    begin: Path | None = None,
    resume: bool = False,
    progress: Progress = silent,
    judged: Callable[[Run], None] = nobody_looks,
) -> Run:
    """Teach one policy one or several references until it reaches the target or the budget ends; saves as it goes.

    Args:
        robot: the robot; its gains become the teacher's.
        pieces: what to imitate.
        folder: where checkpoint, curves, TensorBoard events and bundles go.
        teacher: a tracker.
        config: all numbers; `steps` is the budget in labels where it is not the default.
        begin: the policy that the pupil begins with, of the same robot, table and size.
        resume: go on from the folder's checkpoint.
        progress: told after every round.
        judged: told after every judgement of the pupil.

    Raises:
        TrackingError: no tracker, a policy that the pupil cannot begin with, or the run cannot be resumed.
    """
    with ExitStack() as stack:
        stack.enter_context(run_folder(folder, resume))
        run = Run(folder=folder)
        going_on = resume and (folder / CHECKPOINT).exists()
        if teacher.suffix != ".onnx":  # a teacher of ours, which can learn
            focused = folder / TEACHER if going_on else _focused(run, teacher, robot, pieces, config, progress)
            teacher = focused if focused.exists() else teacher
            if run.stopped:
                return run
            config = as_pupils_see(config)
        lesson = make_lesson(teacher, robot, pieces, folder, config)
        stack.callback(lesson.task.close)
        if begin is not None and not going_on:
            begin_lesson(lesson, begin)
        if going_on:
            restore_lesson(run, lesson, pieces)
        else:
            save_lesson(run, lesson, config, pieces)
        _learn(run, lesson, pieces, config, progress, judged)
        lesson.keep_best()
        run.kept = max(run.curves, key=lambda row: _score(row, pieces), default={})
        if run.reached(config):  # there is nothing left to go on for
            (folder / LABELS).unlink()
        run.onnx_difference = max(
            export_bundle(bundle_folder(folder, p, pieces), lesson.actor, lesson.task, p) for p in pieces
        )
    return run


def teach_tracker(
    teacher: Path,
    robot: RobotModel,
    pieces: Sequence[NamedReference],
    folder: Path,
    config: TrainConfig,
    *,
    progress: Progress = silent,
) -> float:
    """Teach the deployable tracker of a teacher of our own: a bundle without a reference, which follows any.

    Args:
        teacher: `teacher.pt`.
        robot: its robot.
        pieces: what it is taught on; the teacher is asked, and does not learn.
        folder: where the bundle goes.
        config: all numbers; `distillation.samples` is the budget.
        progress: told after every round.

    Returns:
        The largest difference between onnxruntime and torch.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lesson = make_lesson(teacher, robot, pieces, folder, as_pupils_see(config))
    with closing(lesson.task):
        while lesson.samples < lesson.config.samples:
            lesson.iterate()
            progress("teach", lesson.samples, lesson.config.samples, f"loss {lesson.loss:.4f}")
        (folder / LABELS).unlink()
        return export_tracker(folder, lesson.actor, lesson.task)


def _focused(
    run: Run,
    teacher: Path,
    robot: RobotModel,
    pieces: Sequence[NamedReference],
    config: TrainConfig,
    progress: Progress,
) -> Path:
    """A teacher that knows the dances: itself, or what comes of a focus, which is kept in the run's folder.

    A focus that was interrupted goes on from its last judgement, with the memory of its failures lost.
    """
    kept, began = run.folder / TEACHER, time.perf_counter()
    told = load_teacher(kept if kept.exists() else teacher)
    if not told.can_learn:
        return teacher
    places = (teacher.parent / REHEARSAL, SHIPPED / f"tracker-{robot.name}" / REHEARSAL)
    rehearsal = next((p for p in places if p.is_file()), None)
    references = [p.reference for p in (*pieces, *(read_rehearsal_set(rehearsal, robot) if rehearsal else ()))]
    task = teaching_task(
        robot, references, told.config, task=config.task, seed=config.seed, threads=config.threads, focus=len(pieces)
    )
    with closing(task), Signals() as signals:
        trainer = TeacherTrainer(task, told.config, config.seed, config.threads)
        restore_teacher(trainer, told)

        def judged(came: Focus) -> None:
            if came.steps[-1]:
                save_teacher(kept, trainer, told.steps + came.steps[-1])

        def told_to_stop() -> bool:
            run.seconds = time.perf_counter() - began
            return bool(signals.came) or run.seconds - run.before_s > 60.0 * config.focus.share * config.minutes

        came = focus(
            trainer, pieces, told.steps, config.focus, threads=config.threads, progress=progress, judged=judged,
            told_to_stop=told_to_stop,
        )  # fmt: skip
        run.focus_s = run.seconds
        if signals.came:
            run.stopped = signals.came
        elif came.unjudged:
            save_teacher(kept, trainer, told.steps + came.unjudged)
    return kept if kept.exists() else teacher


def _learn(
    run: Run,
    lesson: Distillation,
    pieces: Sequence[NamedReference],
    config: TrainConfig,
    progress: Progress,
    judged: Callable[[Run], None],
) -> None:
    """Rounds of dancing, listening and learning, and judgements, until there is a reason to stop."""
    began, budget = time.perf_counter() - run.seconds, lesson.config.samples
    frames = sum(p.reference.frames for p in pieces) * max(config.fewest_rollouts, config.rollouts // len(pieces))
    every = max(lesson.config.evaluate_every, round(lesson.config.evaluate_share * frames))
    with TensorBoard(run.folder) as board, Signals() as signals:
        if lesson.begun and not run.curves:  # it can dance something already
            _judge(run, lesson, pieces, config, board, progress, judged)
        last_judged = int(run.curves[-1]["steps"]) if run.curves else 0
        run.stopped = run.reason_to_stop(config, budget)
        while not run.stopped:
            causes = lesson.iterate()
            if not math.isfinite(lesson.loss):
                raise TrackingError(
                    f"label {lesson.samples}", found="a loss that is not finite", expected="finite numbers",
                    cure="go on from the last judgement", option="resume", suggestion=" ",
                )  # fmt: skip
            before, run.steps, run.seconds = run.steps, lesson.samples, time.perf_counter() - began
            board.scalars({"teaching/loss": lesson.loss, "teaching/driving": lesson.driving}, run.steps)
            board.scalars({f"failures/{name}": count for name, count in causes.items()}, run.steps)
            progress("teach", run.steps, run.comes_to(config, budget), _line(run, lesson))
            if signals.came:
                run.stopped = signals.came  # what came since the last save is done again, and comes out the same
            elif run.steps in lesson.rests or run.steps - last_judged >= every:
                last_judged = run.steps
                _judge(run, lesson, pieces, config, board, progress, judged)
                run.stopped = run.reason_to_stop(config, budget)
            elif run.steps // _SAVE_EVERY > before // _SAVE_EVERY:
                save_lesson(run, lesson, config, pieces)


def _judge(
    run: Run,
    lesson: Distillation,
    pieces: Sequence[NamedReference],
    config: TrainConfig,
    board: TensorBoard,
    progress: Progress,
    judged: Callable[[Run], None],
) -> None:
    """Evaluate the pupil on every piece, keep it where it is the best so far, save."""
    row = run.evaluate(torch_policy(lesson.actor), lesson.task.robot, pieces, config, progress)
    run.curves.append(row | {"loss": lesson.loss})
    lesson.judged(_score(row, pieces))
    board.evaluation(run.steps, row)
    save_lesson(run, lesson, config, pieces)
    judged(run)


def _score(row: dict[str, float], pieces: Sequence[NamedReference]) -> float:
    """By which judgements are compared: who finishes, and where nobody does who lasts.

    Of several dances the mean, for one of them may be hopeless, and the others are worth keeping.
    """
    finished = [row[f"finished {p.name}"] for p in pieces] if len(pieces) > 1 else [row["finished"]]
    return float(np.mean(finished)) + 0.1 * row["survived_s"] / max(p.reference.duration_s for p in pieces)


def _line(run: Run, lesson: Distillation) -> str:
    told = f"loss {lesson.loss:.4f}, teacher drives {100 * lesson.driving:.0f} %"
    if not run.curves:
        return told
    last = run.curves[-1]
    judged = f"{told}, last judged {last['survived_s']:.1f} s, {100 * last['finished']:.0f} % finish"
    worst = min(run.evaluations.values(), key=lambda e: e.finished, default=None)
    return judged if worst is None or not worst.hardest.failed else f"{judged}, most fail at {worst.hardest.at_s:.0f} s"
