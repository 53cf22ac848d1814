"""`dance-eval`: how well a trained policy performs its reference, over many rollouts."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from cli.terminal import BELOW_GATE, DONE, ClipPath, command, progress
from cli.train import GATE
from clips.files import write_whole
from tracking.errors import TrackingError

if TYPE_CHECKING:
    from tracking import Evaluation


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Roll out a policy bundle over its whole dance and count how often it finishes.

    Examples:
        dance-eval groove-g1
        dance-eval runs/groove
        dance-eval runs/groove --rollouts 500 --json result.json
    """

    bundle: ClipPath
    """Folder that dance-train wrote (policy.onnx, contract.json, reference.npz), or groove-dancer or groove-g1, which
    come with the package."""
    ref: Path | None = None
    """The reference that it was trained on, where it does not lie in the bundle."""
    robot: str | None = None
    """Path of the robot's profile, where it is not a built-in one."""
    rollouts: int = 100
    """How many, each with its own noise and robot."""
    seed: int = 1
    """Seed of noise and robots."""
    randomisation: bool = True
    """Draw every rollout's robot from the training ranges; otherwise the nominal one."""
    json: Path | None = None
    """Write the numbers here too."""
    recording: Path | None = None
    """Write a Rerun recording of the longest rollout here."""


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-eval`."""
    return command(Arguments, run, name="dance-eval", argv=argv)


def run(args: Arguments) -> int:
    """Load, check, roll out, report."""
    from tracking import evaluate, evaluation_task, load_bundle

    if args.rollouts < 1:
        raise TrackingError("--rollouts", found=str(args.rollouts), expected="at least 1")
    console = Console(highlight=False)
    bundle = load_bundle(args.bundle, reference=args.ref, robot=args.robot)
    task = evaluation_task(bundle.config, randomised=args.randomisation)
    with progress("steps") as tell:
        result = evaluate(
            bundle.policy, bundle.robot, bundle.reference, task, rollouts=args.rollouts, seed=args.seed,
            progress=lambda done, total: tell("rollouts", done, total),
        )  # fmt: skip
    span = f"[{100 * result.finished_low:.0f}, {100 * result.finished_high:.0f}] % at 95 %"
    console.print(_table(result, span))
    if args.json is not None:
        with write_whole(args.json) as stream:
            stream.write(json.dumps(result.as_dict(), indent=1).encode())
    if args.recording is not None:
        from cli.show import save_training

        save_training(
            args.recording, bundle.robot, bundle.reference, result.best, {}, f"# {args.bundle}\n{span} finish"
        )
    return DONE if result.finished >= GATE else BELOW_GATE


def _table(result: Evaluation, span: str) -> Table:
    table, hard = Table(box=None, pad_edge=False, show_header=False), result.hardest
    table.add_row("finished", f"{100 * result.finished:.0f} % of {result.rollouts}", span)
    table.add_row("and never 0.5 m off", f"{100 * result.finished_in_place:.0f} %", "in the room")
    table.add_row("survived", f"{result.survived_s:.2f} s", f"of {result.duration_s:.2f} s")
    half = f"+-{result.body_error_half_mm:.1f} at 95 %, root-relative"
    table.add_row("body error", f"{result.body_error_mm:.0f} mm", half)
    table.add_row("error in the room", f"{result.global_error_mm:.0f} mm", "")
    table.add_row("joint error", f"{result.joint_error_rad:.3f} rad", "mean over joints")
    table.add_row("failures", ", ".join(f"{k} {v}" for k, v in result.causes.items() if v) or "none", "")
    where = f"second {hard.at_s:.0f}: {hard.failed} failed" if hard.failed else f"second {hard.at_s:.0f}: none failed"
    table.add_row("hardest", where, f"body error {hard.body_error_mm or 0.0:.0f} mm there")
    for name, value in result.terms.items():
        table.add_row(name.replace("_", " "), f"{value:+.3f}", "of the reward, mean")
    return table
