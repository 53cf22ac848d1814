"""A pupil beside its teacher: what it is shown, what it begins with, and how much it will be told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDict

from robot_models import RobotModel
from tracking.config import DistillationConfig, TrainConfig
from tracking.run_files import LABELS
from tracking.task import NamedReference, TrackingTask
from tracking.teaching.distillation import Distillation
from tracking.teaching.who_teaches import adviser_of
from tracking.training import Team, begin_with, make_algorithm


def as_pupils_see(config: TrainConfig) -> TrainConfig:
    """What a teacher of ours knows exactly, shown to its pupil as far as a robot can tell; as stated, where anything of it is.

    How the reference's root travels, and what was measured before, from which it can feel how fast it goes itself.
    """
    plain = TrainConfig()
    if (config.task.look_back, config.task.root_ahead) != (plain.task.look_back, plain.task.root_ahead):
        return config
    task = replace(config.task, root_ahead=True, look_back=(1, 2, 4, 8))
    hidden = (512, 256) if config.ppo.hidden == plain.ppo.hidden else config.ppo.hidden
    return replace(config, task=task, ppo=replace(config.ppo, hidden=hidden))


def make_lesson(
    teacher: Path, robot: RobotModel, pieces: Sequence[NamedReference], folder: Path, config: TrainConfig
) -> Distillation:
    """A new pupil beside its teacher, on robots with the teacher's gains.

    Args:
        teacher: a tracker.
        robot: its robot.
        pieces: what the pupil shall dance.
        folder: where what it is told goes.
        config: all numbers.
    """
    robot, make_adviser = adviser_of(teacher, robot, pieces)
    task = TrackingTask(
        robot=robot, reference=[p.reference for p in pieces], weights=[p.weight for p in pieces], envs=config.envs,
        config=config.task, seed=config.seed, threads=config.threads,
    )  # fmt: skip
    torch.manual_seed(config.seed)
    torch.set_num_threads(Team().threads(config.threads))
    pupil = make_pupil(task, config)
    return Distillation(task, make_adviser(task), pupil, _budget(config, pieces), folder / LABELS, config.seed)


def begin_lesson(lesson: Distillation, policy: Path) -> None:
    """Let a pupil begin with a policy; raises as `begin_with`."""
    begin_with(lesson.actor, policy, lesson.task)
    lesson.begun = True


def make_pupil(task: TrackingTask, config: TrainConfig) -> Any:
    """A new actor for a task, the same as PPO begins with."""
    seen, critic = task.observe()
    groups = {"policy": torch.as_tensor(seen), "critic": torch.as_tensor(critic)}
    observation = TensorDict(groups, batch_size=[task.envs], device="cpu")
    return make_algorithm(observation, task, config.ppo, Team()).get_policy()


def _budget(config: TrainConfig, pieces: Sequence[NamedReference]) -> DistillationConfig:
    c, seconds = config.distillation, sum(p.reference.duration_s for p in pieces)
    by_length = round(min(c.bounds[1], max(c.bounds[0], c.per_second * seconds)))
    return replace(c, samples=c.samples or by_length)
