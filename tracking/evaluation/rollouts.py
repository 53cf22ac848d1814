"""How well a policy performs the whole dance: rollouts from its first frame, judged by the field's rule.

A robot that strays (a hand or a foot too far off) has not fallen: it dances on here, and the two are counted apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import reduce
from operator import or_
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import Reference
from retarget.recordings import save_rollouts, show
from robot_models import RobotModel
from robot_models.maths import Progress, silent
from tracking.config import TaskConfig
from tracking.engines import Engine, MujocoBatch
from tracking.evaluation.share import Z95, Share, wilson
from tracking.policy import Policy, Runner
from tracking.task import FALLS, StepResult, TrackingTask

IN_PLACE = 0.5  # largest mean distance of the tracked bodies from the reference in the room, the field's other rule [m]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Evaluation:
    """Result of many rollouts of the whole dance. Errors are means over all frames in which a rollout stood."""

    rollouts: int
    finished: float  # share that reached the last frame within the rules
    finished_low: float  # 95 % Wilson interval
    finished_high: float
    finished_in_place: float  # share that finished and was never 0.5 m off in the room (mean over tracked bodies)
    survived_s: float  # mean time before the failure or the end [s]
    stood: float  # share that did not fall, whether it strayed or not
    stood_s: float  # mean time before the fall or the end [s]
    duration_s: float  # of the dance [s]
    body_error_mm: float  # mean over tracked bodies, root-relative
    body_error_half_mm: float  # half width of its 95 % interval, over rollouts
    global_error_mm: float  # mean over tracked bodies, in the room; the actor cannot see it
    joint_error_rad: float
    causes: dict[str, int]  # failures by cause
    terms: dict[str, float]  # mean of every weighted reward term
    seconds: tuple[Second, ...]  # of the dance, one after another
    shown: Mapping[str, Float[ndarray, "N nq"]]  # qpos of some rollouts from the dance's first frame on: the best first

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {share.count}" for name, share in self.outcomes.items())
        return f"Evaluation({self.rollouts} rollouts: {told}; bodies {self.body_error_mm:.0f} mm off)"

    def save(self, path: Path | str, robot: RobotModel, reference: Reference) -> Path:
        """Write a Rerun recording (.rrd) of the best, the median and a failed rollout beside their ghosts.

        Args:
            path: the recording.
            robot: whom the rollouts are of.
            reference: what they follow.
        """
        path = Path(path)
        save_rollouts(path, robot, reference, self.shown, {}, f"# {self!r}")
        return path

    def show(self, robot: RobotModel, reference: Reference) -> None:
        """The same in Rerun's viewer, in a window of its own."""
        show(lambda path: self.save(path, robot, reference))

    @property
    def outcomes(self) -> dict[str, Share]:
        """How the rollouts ended: finished; strayed, which is off the dance and yet never fell; fell."""
        finished, stood = (round(share * self.rollouts) for share in (self.finished, self.stood))
        counts = {
            "finished": finished,
            "strayed": max(0, stood - finished),
            "fell": self.rollouts - max(stood, finished),
        }
        return {name: Share(count=count, of=self.rollouts) for name, count in counts.items()}

    def as_dict(self) -> dict[str, object]:
        """Numbers without the rollouts."""
        shares = {name: {"count": s.count, "of": s.of, "interval": s.interval} for name, s in self.outcomes.items()}
        return {k: v for k, v in asdict(self).items() if k != "shown"} | {"outcomes": shares}

    @property
    def hardest(self) -> Second:
        """The second in which most rollouts failed; among equals, the one with the largest error."""
        return max(self.seconds, key=lambda s: (s.failed, s.body_error_mm or 0.0))


@dataclass(frozen=True, kw_only=True)
class Second:
    """One second of the dance."""

    at_s: float  # its beginning, from the dance's first frame [s]
    failed: int  # rollouts that ended in it
    body_error_mm: float | None  # of those that stood; None if none did


def evaluate(
    policy: Policy | Runner,
    robot: RobotModel,
    reference: Reference,
    config: TaskConfig,
    *,
    rollouts: int = 100,
    seed: int = 1,
    threads: int = 0,
    engine: Engine = MujocoBatch,
    progress: Progress = silent,
) -> Evaluation:
    """Roll out the deterministic policy from the dance's first frame, with start and observation noise on.

    Args:
        policy: the network alone, shown the simulation's own observations; or a bundle's runner, shown the sensors.
        robot: the robot.
        reference: the dance.
        config: noise and randomisation as they shall be in the evaluation.
        rollouts: how many, at once.
        seed: of noise and robots.
        threads: of the physics; 0: all.
        engine: the physics; one that computes in main memory.
        progress: told after every control step.
    """
    task = TrackingTask(
        robot=robot, reference=reference, envs=rollouts, config=config, seed=seed, threads=threads, engine=engine
    )
    dance = reference.dance
    steps, tally = dance.stop - 1 - dance.start, _Tally(rollouts)
    with closing(task):
        task.reset(np.arange(rollouts), np.full(rollouts, dance.start))
        if isinstance(policy, Runner):
            start(policy, task)
        path = [task.physics.qpos.copy()]
        for done in range(steps):
            result = play(policy, task)
            tally.add(result, task)
            path.append(task.physics.qpos.copy())
            progress("rollouts", done + 1, steps)
            if not tally.standing.any():
                break
    return tally.result(task.dt, steps, np.stack(path))


def start(runner: Runner, task: TrackingTask, frame: int | None = None) -> None:
    """Let a runner begin on the task's robots, by default with the dance's first frame."""
    runner.start(task.measured().picked(_order(runner, task)), frame)


def play(policy: Policy | Runner, task: TrackingTask) -> StepResult:
    """One control period of the task under a policy; a runner has been started before."""
    if not isinstance(policy, Runner):
        return task.step(policy(task.observe()[0]))
    order = _order(policy, task)
    # Joints that the policy does not know rest at their default.
    action, targets = np.zeros((task.envs, task.actions)), np.tile(task.robot.default_joint_pos, (task.envs, 1))
    targets[:, order] = policy.act(task.measured().picked(order))
    action[:, order] = policy.last_action
    return task.step(action, targets)


def _order(runner: Runner, task: TrackingTask) -> Int[ndarray, "J"]:
    """Places of the policy's joints in the robot's order."""
    return np.array([task.robot.joint(name) for name in runner.contract.joint_names])


class _Tally:
    """What N rollouts come to, each until it fails."""

    def __init__(self, rollouts: int) -> None:
        self.alive, self.standing, self._in_place = np.ones((3, rollouts), dtype=bool)  # alive: within the rules
        self._lasted, self._stood = np.zeros((2, rollouts))
        self._causes: dict[str, int] = {}
        self._terms: dict[str, float] = {}
        self._errors: list[ndarray] = []  # per step: (3, N) body, room, joint errors; NaN where a rollout has ended

    def add(self, result: StepResult, task: TrackingTask) -> None:
        for name, failed in result.causes.items():
            self._causes[name] = self._causes.get(name, 0) + int((failed & self.alive).sum())
        self.alive &= ~result.terminated
        self.standing &= ~reduce(or_, (result.causes[cause] for cause in FALLS))
        self._lasted += self.alive
        self._stood += self.standing
        for name, value in result.terms.items():
            self._terms[name] = self._terms.get(name, 0.0) + float(value[self.alive].sum())
        room = np.linalg.norm(task.tables.pos[task.frame] - task.sensors.states.pos, axis=-1).mean(axis=1)
        self._in_place &= ~self.alive | (room <= IN_PLACE)
        joint = np.abs(task.physics.qpos[:, 7:] - task.tables.joint_pos[task.frame]).mean(axis=1)
        body = np.linalg.norm(result.errors.body_pos, axis=-1).mean(axis=1)
        self._errors.append(np.where(self.alive, np.stack((body, room, joint)), np.nan))

    def result(self, dt: float, steps: int, path: Float[ndarray, "T N nq"]) -> Evaluation:
        count = len(self.alive)
        low, high = wilson(int(self.alive.sum()), count)
        errors, frames = np.stack(self._errors), max(1.0, self._lasted.sum())
        body, room, joint = np.nansum(errors, axis=(0, 2)) / frames
        each = np.nansum(errors[:, 0], axis=0)[self._lasted > 0] / self._lasted[self._lasted > 0]
        spread = float(each.std(ddof=1)) if len(each) > 1 else 0.0
        return Evaluation(
            rollouts=count,
            finished=float(self.alive.mean()),
            finished_low=low,
            finished_high=high,
            finished_in_place=float((self.alive & self._in_place).mean()),
            survived_s=float(self._lasted.mean() * dt),
            stood=float(self.standing.mean()),
            stood_s=float(self._stood.mean() * dt),
            duration_s=steps * dt,
            body_error_mm=1e3 * float(body),
            body_error_half_mm=1e3 * Z95 * spread / max(1.0, np.sqrt(len(each))),
            global_error_mm=1e3 * float(room),
            joint_error_rad=float(joint),
            causes=self._causes,
            terms={name: value / frames for name, value in self._terms.items()},
            seconds=self._seconds(errors[:, 0], steps, max(1, round(1.0 / dt))),
            shown=self._shown(path, np.nansum(errors[:, 0], axis=0), dt),
        )

    def _shown(self, path: Float[ndarray, "T N nq"], error: Float[ndarray, "N"], dt: float) -> dict[str, ndarray]:
        """The best, the median and the first that failed, each to its end, or to its fall."""
        order = np.lexsort(
            (error / np.maximum(self._lasted, 1.0), -self._lasted)
        )  # the longest first, then the nearest
        ranks = {"best": order[0], "median": order[len(order) // 2], "worst": order[-1]}
        shown, seen = {}, set[int]()
        for rank, k in ((rank, int(k)) for rank, k in ranks.items()):
            if k in seen or (rank == "worst" and self.alive[k]):
                continue
            seen.add(k)
            how = "finished" if self.alive[k] else "strayed" if self.standing[k] else "fell"
            when = "" if self.alive[k] else f" at {(self._lasted if self.standing[k] else self._stood)[k] * dt:.1f} s"
            shown[f"{rank}: {how}{when}"] = path[: int(self._stood[k]) + 1, k]
        return shown

    def _seconds(self, body: Float[ndarray, "T N"], steps: int, per_second: int) -> tuple[Second, ...]:
        ended = self._lasted[~self.alive]
        out = []
        for a in range(0, steps, per_second):
            part = body[a : a + per_second]
            standing = part[np.isfinite(part)]
            out.append(
                Second(
                    at_s=a / per_second,
                    failed=int(((ended >= a) & (ended < a + per_second)).sum()),
                    body_error_mm=1e3 * float(standing.mean()) if len(standing) else None,
                )
            )
        return tuple(out)


def evaluation_task(config: TaskConfig, *, randomised: bool = True) -> TaskConfig:
    """The task as evaluations run it: noise on, no pushes; the robots drawn from the ranges, or all nominal."""
    drawn = replace(config.randomisation, enabled=randomised and config.randomisation.enabled, pushes=False)
    return replace(config, randomisation=drawn)
