"""Is a reference worth training on? What can be known of that before the first step of learning."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np

from clips import Reference
from robot_models import RobotModel
from tracking.config import CheckConfig, TaskConfig
from tracking.evaluation.rollouts import evaluation_task
from tracking.task import TrackingTask, beyond_soft_limits, compare, reward_terms

_RULES = CheckConfig()


@dataclass(frozen=True, kw_only=True)
class ReferenceCheck:
    """What the check found. The first three decide; the rest tells how hard the dance will be."""

    failed_gates: tuple[str, ...]  # of the reference's own report
    beyond_limits: float  # share of frames with a joint beyond its range
    perfect: float  # reward of perfect tracking, of the largest that there is
    too_fast: float  # share of frames with a joint faster than its motor
    settles_m: float  # how far the pelvis sinks while the robot holds the first pose for a second
    survived_s: float  # mean time that zero action survives, over starts all along the dance

    @property
    def passed(self) -> bool:
        """Whether training on it makes sense."""
        return not self.failed_gates and self.beyond_limits == 0.0 and self.perfect > _RULES.least_reward


def check_reference(
    reference: Reference, robot: RobotModel, config: TaskConfig | None = None, threads: int = 0
) -> ReferenceCheck:
    """Play a reference perfectly, then with zero action from starts all along it.

    Args:
        reference: what a policy shall imitate.
        robot: its robot.
        config: the task; noise and randomisation are off here.
        threads: of the physics; 0: all.
    """
    config = config or TaskConfig()
    calm = evaluation_task(replace(config, start_noise=replace(config.start_noise, scale=0.0)), randomised=False)
    task = TrackingTask(robot=robot, reference=reference, envs=_RULES.starts, config=calm, threads=threads)
    joints = np.asarray(reference.joint_pos)
    outside = (joints < robot.lower - _RULES.limit_slack) | (joints > robot.upper + _RULES.limit_slack)
    with closing(task):
        return ReferenceCheck(
            failed_gates=reference.failed_gates,
            beyond_limits=float(outside.any(axis=1).mean()),
            perfect=_perfect(task),
            too_fast=float((np.abs(reference.joint_vel) > robot.velocity).any(axis=1).mean()),
            settles_m=_settles(task),
            survived_s=_survived(task),
        )


def _perfect(task: TrackingTask) -> float:
    """Mean reward of robots put on the reference itself, over the largest reward."""
    c, tables = task.config.rewards, task.tables
    frames = np.linspace(0, tables.frames - 1, task.envs).astype(int)
    task.reset(np.arange(task.envs), frames)
    zero, robot = np.zeros((task.envs, task.actions)), task.robot
    over = beyond_soft_limits(tables.joint_pos[frames], robot.lower, robot.upper, c.soft_limit)
    terms = reward_terms(compare(task.sensors.states, tables, frames), zero, zero, over, c)
    largest = sum(max(0.0, getattr(c, name)) for name in terms)
    return float(np.sum(list(terms.values()), axis=0).mean() / largest)


def _settles(task: TrackingTask) -> float:
    ids = np.arange(task.envs)
    task.reset(ids, np.zeros(task.envs, dtype=int))
    task.physics.qvel[:] = 0.0
    for _ in range(round(1.0 / task.dt)):
        task.physics.step(np.tile(task.targets[0], (task.envs, 1)))
    return float(task.tables.qpos[0, 2] - task.physics.qpos[:, 2].mean())


def _survived(task: TrackingTask) -> float:
    task.reset(np.arange(task.envs), np.linspace(0, 0.8 * task.tables.frames, task.envs).astype(int))
    alive, lasted = np.ones(task.envs, dtype=bool), np.zeros(task.envs)
    for _ in range(task.tables.frames):
        result = task.step(np.zeros((task.envs, task.actions)))
        lasted += alive
        alive &= ~(result.terminated | result.truncated)
        if not alive.any():
            break
    return float(lasted.mean() * task.dt)
