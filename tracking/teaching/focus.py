"""A new dance for a teacher, without forgetting: its own optimisation goes on, the dance in most of the episodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel
from robot_models.maths import Progress, silent
from tracking.config import FocusConfig, TaskConfig
from tracking.evaluation import Standing, evaluation_task, judge_standing
from tracking.task import NamedReference, TrackingTask
from tracking.teaching.teacher import SymmetricActor, TeacherTrainer, teacher_actions


@dataclass(kw_only=True)
class Focus:
    """What a focus came to: how well the dances stood after so many steps."""

    steps: list[int] = field(default_factory=list)
    standing: list[list[Standing]] = field(default_factory=list)  # of every dance in focus
    unjudged: int = 0  # control steps done, where the end came between two judgements

    @property
    def score(self) -> list[float]:
        """Of every judgement: mean of the stands, and of the shares of the seconds."""
        return [
            float(np.mean([0.5 * (s.stand + s.seconds / s.possible_s) for s in judged])) for judged in self.standing
        ]

    def over(self, config: FocusConfig) -> bool:
        """Whether the dances are known, or no judgement has been better for a while."""
        score = self.score
        return bool(score) and (score[-1] >= config.stands or len(score) - 1 - int(np.argmax(score)) >= config.patience)


def judge_teacher(
    actor: SymmetricActor,
    robot: RobotModel,
    pieces: Sequence[NamedReference],
    threads: int = 1,
    *,
    seed: int = 1,
    starts: int = 16,
    openings: int = 4,
) -> list[Standing]:
    """How well a teacher follows references, on robots drawn by the seed, at the physics of evaluations; as `judge_standing`."""

    def act(task: TrackingTask) -> Float[ndarray, "N J"]:
        return teacher_actions(actor, task.observe_all()[0])

    return judge_standing(
        act, robot, pieces, evaluation_task(TaskConfig()), threads=threads, seed=seed, starts=starts, openings=openings
    )


def focus(
    trainer: TeacherTrainer,
    pieces: Sequence[NamedReference],
    steps: int,
    config: FocusConfig,
    *,
    threads: int = 1,
    progress: Progress = silent,
    judged: Callable[[Focus], None] = lambda _: None,
    told_to_stop: Callable[[], bool] = lambda: False,
) -> Focus:
    """Let a teacher go on until it knows the dances or gets no better.

    Args:
        trainer: on a task whose first references are the dances, the others what the teacher shall not forget.
        pieces: the dances.
        steps: how many control steps the teacher has behind it: its schedule goes on from there.
        config: all numbers.
        threads: of the physics of judgements.
        progress: told after every iteration.
        judged: told after every judgement.
        told_to_stop: asked after every iteration.
    """
    came, done, last_judged = Focus(), 0, -1
    while done < config.most_steps:
        if done // config.evaluate_every > last_judged:
            last_judged = done // config.evaluate_every
            came.steps.append(done)
            robot, seed = trainer.task.robot, 1 + last_judged  # robots that no judgement had before
            came.standing.append(judge_teacher(trainer.actor, robot, pieces, threads, seed=seed))
            judged(came)
            if came.over(config):
                break
        result = trainer.iterate_at(steps + done, config.kl)
        done += result.steps
        last = came.standing[-1]
        seconds, possible = sum(s.seconds for s in last), sum(s.possible_s for s in last)
        progress("focus, at most", done, config.most_steps, f"the teacher dances {seconds:.1f} of {possible:.1f} s")
        if told_to_stop():
            came.unjudged = done
            break
    return came
