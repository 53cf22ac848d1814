"""How well a policy performs the whole dance: rollouts from its first frame, judged by the field's rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference
from robot_models import RobotModel
from tracking.config import TaskConfig
from tracking.task import StepResult, TrackingTask

Policy = Callable[[Float[ndarray, "N A"]], Float[ndarray, "N J"]]  # observations -> mean actions
_Z95 = 1.96


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """Result of many rollouts of the whole dance."""

    rollouts: int
    finished: float  # share that reached the last frame without failing
    finished_low: float  # 95 % Wilson interval
    finished_high: float
    survived_s: float  # mean time before the failure or the end [s]
    duration_s: float  # of the dance [s]
    body_error_mm: float  # mean over tracked bodies, root-relative, while standing
    global_error_mm: float  # drift of the anchor in the room
    joint_error_rad: float
    causes: dict[str, int]  # failures by cause
    best: Float[ndarray, "N nq"]  # qpos of the rollout that lasted longest, from the dance's first frame

    def as_dict(self) -> dict[str, object]:
        """Numbers without the rollout."""
        return {k: v for k, v in asdict(self).items() if k != "best"}


def evaluate(
    policy: Policy,
    robot: RobotModel,
    reference: Reference,
    config: TaskConfig,
    *,
    rollouts: int = 100,
    seed: int = 1,
    threads: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Roll out the deterministic policy from the dance's first frame, with start and observation noise on.

    Args:
        policy: observations to mean actions.
        robot: the robot.
        reference: the dance.
        config: noise and randomisation as they shall be in the evaluation.
        rollouts: how many, at once.
        seed: of noise and robots.
        threads: of the physics; 0: all.
        progress: told after every control step.
    """
    task = TrackingTask(robot=robot, reference=reference, envs=rollouts, config=config, seed=seed, threads=threads)
    dance = reference.dance
    steps = dance.stop - 1 - dance.start
    task.reset(np.arange(rollouts), np.full(rollouts, dance.start))
    tally = _Tally(rollouts)
    path = [task.physics.qpos.copy()]
    for done in range(steps):
        tally.add(
            task.step(policy(task.observe()[0])), np.abs(task.physics.qpos[:, 7:] - task.tables.joint_pos[task.frame])
        )
        path.append(task.physics.qpos.copy())
        if progress is not None:
            progress(done + 1, steps)
        if not tally.alive.any():
            break
    task.close()
    return tally.result(task.dt, steps, np.stack(path))


class _Tally:
    """Counts of rollouts that go on until each has failed; errors count while a rollout is alive."""

    def __init__(self, rollouts: int) -> None:
        self.alive = np.ones(rollouts, dtype=bool)
        self._lasted = np.zeros(rollouts)
        self._sums = np.zeros(3)  # body, drift, joint errors over all living steps
        self._causes: dict[str, int] = {}

    def add(self, result: StepResult, joint_error: Float[ndarray, "N J"]) -> None:
        for name, failed in result.causes.items():
            self._causes[name] = self._causes.get(name, 0) + int((failed & self.alive).sum())
        self.alive &= ~result.terminated
        self._lasted += self.alive
        body = np.linalg.norm(result.errors.body_pos, axis=-1).mean(axis=1)
        drift = np.linalg.norm(result.errors.anchor_pos, axis=-1)
        self._sums += [e[self.alive].sum() for e in (body, drift, joint_error.mean(axis=1))]

    def result(self, dt: float, steps: int, path: Float[ndarray, "T N nq"]) -> Evaluation:
        best = int(np.argmax(self._lasted))
        low, high = wilson(int(self.alive.sum()), len(self.alive))
        body, drift, joint = self._sums / max(1.0, self._lasted.sum())
        return Evaluation(
            rollouts=len(self.alive),
            finished=float(self.alive.mean()),
            finished_low=low,
            finished_high=high,
            survived_s=float(self._lasted.mean() * dt),
            duration_s=steps * dt,
            body_error_mm=1e3 * float(body),
            global_error_mm=1e3 * float(drift),
            joint_error_rad=float(joint),
            causes=self._causes,
            best=path[: int(self._lasted[best]) + 1, best],
        )


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Wilson 1927): right near 0 and 1 too."""
    p, n, z = successes / trials, trials, _Z95
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return float(max(0.0, centre - half)), float(min(1.0, centre + half))


def evaluation_task(config: TaskConfig, *, randomised: bool = True) -> TaskConfig:
    """The task as evaluations run it: noise on, no pushes; the robots drawn from the ranges, or all nominal."""
    drawn = replace(config.randomisation, enabled=randomised and config.randomisation.enabled, pushes=False)
    return replace(config, randomisation=drawn)
