"""How well something follows many references at once: who still stands after two seconds, and how long from the beginning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel
from tracking.config import TaskConfig
from tracking.task import NamedReference, TrackingTask

Act = Callable[[TrackingTask], Float[ndarray, "N J"]]
"""The actions of a policy in the present state of a task."""


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What came of one reference."""

    name: str
    stand: float  # share of starts along the dance from which robots stay within the rules for two seconds
    seconds: float  # mean time within the rules from the dance's first frame, at most `longest_s`
    possible_s: float  # the dance's length, or `longest_s`


def judge_standing(
    act: Act,
    robot: RobotModel,
    references: Sequence[NamedReference],
    config: TaskConfig,
    *,
    starts: int = 16,
    openings: int = 4,
    longest_s: float = 10.0,
    stand_s: float = 2.0,
    seed: int = 1,
    threads: int = 1,
) -> list[Standing]:
    """Play every reference from starts along it and from its beginning, all at once.

    Args:
        act: the policy.
        robot: the robot.
        references: what to follow.
        config: noise and robots, as for evaluations.
        starts: per reference, spread evenly along it.
        openings: per reference, at its first frame.
        longest_s: how long these are played at most [s].
        stand_s: how long those are played [s].
        seed: of noise and robots.
        threads: of the physics.
    """
    task = TrackingTask(
        robot=robot, reference=[r.reference for r in references], envs=len(references) * (starts + openings),
        config=config, seed=seed, threads=threads,
    )  # fmt: skip
    with closing(task):
        task.reset(np.arange(task.envs), _begins(task, starts, openings, round(stand_s / task.dt)))
        standing = np.ones((len(references), starts + openings), dtype=bool)
        lasted, shares = np.zeros(standing.shape), np.zeros(len(references))
        dances = np.array([r.reference.dance.stop - 1 - r.reference.dance.start for r in references])  # [frames]
        stand, longest = round(stand_s / task.dt), round(longest_s / task.dt)
        for k in range(max(stand, min(longest, int(dances.max())))):
            result = task.step(act(task))
            standing &= ~result.terminated.reshape(standing.shape)
            lasted += standing & (k < dances)[:, None]
            if k + 1 == stand:
                shares = standing[:, :starts].mean(axis=1)
            if not standing[:, starts:].any():
                break
    return [
        Standing(
            name=r.name,
            stand=float(shares[i]),
            seconds=float(lasted[i, starts:].mean() * task.dt),
            possible_s=min(longest_s, task.dt * float(dances[i])),
        )
        for i, r in enumerate(references)
    ]


def _begins(task: TrackingTask, starts: int, openings: int, room: int) -> ndarray:
    """First frames of every rollout."""
    begin = [
        np.r_[np.linspace(o, max(o, task.tables.last[o] - room), starts).astype(int), np.full(openings, o)]
        for o in task.tables.openings
    ]
    return np.concatenate(begin)
