"""Who tells a pupil what to do: a teacher of our own, or another tool's tracker."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from tracking.policy import Runner, one_after_another
from tracking.task import TrackingTask
from tracking.teaching.teacher import SymmetricActor, teacher_actions


@runtime_checkable
class Adviser(Protocol):
    """Tells what a teacher would do with the robots of a task."""

    def restart(self, ids: Int[ndarray, "n"]) -> None:
        """Some robots have been put elsewhere."""

    def advise(self) -> Float[ndarray, "N J"]:
        """Its actions in the task's present state, as the task's actions; asked once in every control period."""

    def hear(self, action: Float[ndarray, "N J"]) -> None:
        """What was done instead."""


class TeacherAdviser:
    """A teacher of our own."""

    def __init__(self, actor: SymmetricActor, task: TrackingTask) -> None:
        self._actor, self._task = actor, task

    def restart(self, ids: Int[ndarray, "n"]) -> None:
        """Nothing to do: it has no memory."""

    def advise(self) -> Float[ndarray, "N J"]:
        """As `Adviser`."""
        return teacher_actions(self._actor, self._task.observe_all()[0])

    def hear(self, action: Float[ndarray, "N J"]) -> None:
        """Nothing to do: the task itself shows it the last action."""


class TrackerAdviser:
    """Another tool's tracker; what it asks of the servos is told as the action that asks the same."""

    def __init__(self, runners: Sequence[Runner], task: TrackingTask) -> None:
        self._task, contract = task, runners[0].contract
        motion = one_after_another([r.motion for r in runners])
        self._runner = Runner(contract, runners[0].policy, motion)
        self._order = np.array([task.robot.joint(name) for name in contract.joint_names])
        self._runner.start(self._measured())
        self.restart(np.arange(task.envs))

    def restart(self, ids: Int[ndarray, "n"]) -> None:
        """As `Adviser`."""
        self._runner.restart(ids, self._measured().of(ids), self._task.frame[ids])

    def advise(self) -> Float[ndarray, "N J"]:
        """As `Adviser`."""
        task = self._task
        targets = task.targets[task.tables.ahead(task.frame, 1)].copy()
        own = targets[:, self._order]
        action = np.zeros_like(targets)
        action[:, self._order] = (self._runner.act(self._measured()) - own) / task.action_scale[self._order]
        return action

    def hear(self, action: Float[ndarray, "N J"]) -> None:
        """As `Adviser`: it remembers what was done as if it had been its own output."""
        task, runner = self._task, self._runner
        targets = task.targets[task.tables.ahead(task.frame, 1)] + task.action_scale * action
        done = (targets[:, self._order] - runner.motion.targets[runner.frame]) / runner.contract.action_scale
        runner.actions[0][:] = done

    def _measured(self) -> Any:
        return self._task.measured(noisy=False, faulty=False).picked(self._order)
