"""One training run from a reference to a bundle, with its curves and checkpoints."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from robot_models import RobotModel
from robot_models.maths import Progress, silent
from tracking.config import PpoConfig, TrainConfig
from tracking.engines import training_engine
from tracking.errors import TrackingError
from tracking.run_files import CHECKPOINT, CURVES
from tracking.task import NamedReference, TrackingTask, bundle_folder, motion_set_sha256
from tracking.training.actor_export import export_bundle, torch_policy
from tracking.training.checkpoint import begin_run, load_checkpoint, restore, save_checkpoint
from tracking.training.curves import TensorBoard, write_curves
from tracking.training.distributed import join_team
from tracking.training.ppo import Iteration, Trainer
from tracking.training.run_record import Run, nobody_looks, run_folder
from tracking.training.stop_signals import Signals

_APART = 10_000  # between the seeds of the processes of a team
_SAVE_S = 120.0  # of wall time between two checkpoints, at most [s]


def train(
    robot: RobotModel,
    pieces: Sequence[NamedReference],
    folder: Path,
    config: TrainConfig,
    *,
    begin: Path | None = None,
    resume: bool = False,
    progress: Progress = silent,
    judged: Callable[[Run], None] = nobody_looks,
) -> Run:
    """Train one policy on one or several references until it reaches the target or the budget ends; saves as it goes.

    Args:
        robot: the robot.
        pieces: what to imitate.
        folder: where checkpoint, curves, TensorBoard events and bundles go.
        config: all numbers.
        begin: a policy to begin with, of the same robot, table and size: of a run of PPO its critic and optimiser too; of any
            other bundle the actor, whose critic then learns alone for a while.
        resume: go on from the folder's checkpoint.
        progress: told after every iteration.
        judged: told after every judgement.

    Raises:
        TrackingError: the run cannot be resumed, or its numbers stopped being finite.
    """
    with ExitStack() as stack:
        team = join_team()
        stack.callback(team.leave)
        if team.is_leader:
            stack.enter_context(run_folder(folder, resume))
        task = TrackingTask(
            robot=robot, reference=[p.reference for p in pieces], weights=[p.weight for p in pieces],
            envs=team.share(config.envs, "environments"), config=config.task, seed=config.seed + _APART * team.rank,
            threads=team.threads(config.threads), engine=training_engine(config.engine),
        )  # fmt: skip
        stack.callback(task.close)
        trainer = Trainer(task, config.ppo, config.seed, config.threads, team)
        run = Run(folder=folder, begun=begin is not None)
        if begin is not None and not resume:
            begin_run(trainer, begin)
        if resume:
            saved = restore(trainer, load_checkpoint(folder / CHECKPOINT), config, motion_set_sha256(pieces))
            run.steps, run.seconds, run.curves = saved["steps"], saved["seconds"], saved["curves"]
            run.saved, run.before_s = run.steps, run.seconds
        _learn(run, trainer, pieces, config, progress, judged)
        if team.is_leader:
            run.onnx_difference = max(
                export_bundle(bundle_folder(folder, piece, pieces), trainer.actor, task, piece) for piece in pieces
            )
    return run


def _learn(
    run: Run,
    trainer: Trainer,
    pieces: Sequence[NamedReference],
    config: TrainConfig,
    progress: Progress,
    judged: Callable[[Run], None],
) -> None:
    """Iterate and judge until there is a reason to stop."""
    team, sha, began = trainer.team, motion_set_sha256(pieces), time.perf_counter() - run.seconds
    with TensorBoard(run.folder if team.is_leader else None) as board, Signals() as signals:
        if not run.curves:
            _judge(run, trainer, pieces, config, board, progress, judged)
        run.stopped = team.broadcast(run.reason_to_stop(config, config.steps))
        told_to, saved = "", time.monotonic()
        while not run.stopped:
            trainer.task.advance_curriculum(1.0 if run.begun else run.steps / config.steps)
            result = trainer.iterate(_wanted_kl(config.ppo, run))
            _check_finite(result, trainer, run, config, sha)
            run.steps += result.steps
            run.seconds = time.perf_counter() - began
            board.iteration(run.steps, result)
            progress("train", run.steps, run.comes_to(config, config.steps), _line(run, result))
            if run.steps // config.evaluate_every > (run.steps - result.steps) // config.evaluate_every:
                _judge(run, trainer, pieces, config, board, progress, judged)
                saved = time.monotonic()
            elif team.broadcast(time.monotonic() - saved > _SAVE_S):  # the leader's clock
                _save(run, trainer, config, sha)
                saved = time.monotonic()
            told_to = next(filter(None, team.gather(signals.came)), "")  # any process may be told
            run.stopped = team.broadcast(told_to or run.reason_to_stop(config, config.steps))
        # A run that is told to stop has little time: it saves, and is judged when it is resumed.
        if run.curves[-1]["steps"] != run.steps and not told_to:
            _judge(run, trainer, pieces, config, board, progress, judged)
        _save(run, trainer, config, sha)


def _wanted_kl(c: PpoConfig, run: Run) -> float:
    """The divergence that an update shall have: smaller as the run goes on, and as more of the last rollouts finished.

    The smallest for who began with a policy, which larger ones would make it forget.
    """
    if run.begun:
        return c.finishing_kl
    settled = c.first_kl * (c.settled_kl / c.first_kl) ** min(1.0, run.steps / c.settle_steps)
    return float(settled * (c.finishing_kl / c.settled_kl) ** run.curves[-1]["finished"])


def _judge(
    run: Run,
    trainer: Trainer,
    pieces: Sequence[NamedReference],
    config: TrainConfig,
    board: TensorBoard,
    progress: Progress,
    judged: Callable[[Run], None],
) -> None:
    """Evaluate on every piece, note the means, save."""
    row: dict[str, float] = {}
    if trainer.team.is_leader:
        row = run.evaluate(torch_policy(trainer.actor), trainer.task.robot, pieces, config, progress)
    row = trainer.team.broadcast(row)
    run.curves.append(row)
    board.evaluation(run.steps, row)
    _save(run, trainer, config, motion_set_sha256(pieces))
    if trainer.team.is_leader:
        judged(run)


def _save(run: Run, trainer: Trainer, config: TrainConfig, sha: str) -> None:
    progress = {"steps": run.steps, "seconds": run.seconds, "curves": run.curves}
    save_checkpoint(run.folder / CHECKPOINT, trainer, config, sha, progress)
    run.saved = run.steps
    if run.curves and trainer.team.is_leader:
        write_curves(run.folder / CURVES, run.curves)


def _check_finite(result: Iteration, trainer: Trainer, run: Run, config: TrainConfig, sha: str) -> None:
    broadcast = {**result.losses, **result.terms, "kl": result.kl}
    bad = {k for part in trainer.team.gather([k for k, v in broadcast.items() if not math.isfinite(v)]) for k in part}
    if not bad:
        return
    save_checkpoint(run.folder / "diverged.pt", trainer, config, sha, {"steps": run.steps})
    raise TrackingError(
        f"training step {run.steps}", found=f"{', '.join(sorted(bad))} not finite", expected="finite numbers",
        cure=f"the state is kept in {run.folder / 'diverged.pt'}; lower the learning rate",
    )  # fmt: skip


def _line(run: Run, result: Iteration) -> str:
    last = run.curves[-1]
    return f"episode {result.episode_s:.2f} s, evaluation {last['survived_s']:.2f} s ({100 * last['finished']:.0f} % finish)"
