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
    console = Console(highlight=False, soft_wrap=True)
    bundle = load_bundle(args.bundle, reference=args.ref, robot=args.robot)
    task = evaluation_task(bundle.config, randomised=args.randomisation)
    with progress("steps") as tell:
        result = evaluate(
            bundle.runner, bundle.robot, bundle.reference, task, rollouts=args.rollouts, seed=args.seed,
            progress=lambda done, total: tell("rollouts", done, total),
        )  # fmt: skip
    rows = _rows(result)
    table = Table(box=None, pad_edge=False, show_header=False)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    if args.json is not None:
        with write_whole(args.json) as stream:
            stream.write(json.dumps(result.as_dict(), indent=1).encode())
        console.print(f"wrote {args.json}", markup=False)
    if args.recording is not None:
        from cli.show import save_training

        text = "\n".join([f"# {args.bundle}", "| | | |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)])
        save_training(args.recording, bundle.robot, bundle.reference, result.best, {}, text)
        console.print(f"wrote {args.recording}   open it: rerun {args.recording}", markup=False)
    return DONE if result.finished >= GATE else BELOW_GATE


def _rows(r: Evaluation) -> list[tuple[str, str, str]]:
    """What is measured, its value, a remark."""
    hard, span = r.hardest, f"[{100 * r.finished_low:.0f}, {100 * r.finished_high:.0f}] % at 95 %"
    failed = f"{hard.failed} failed" if hard.failed else "none failed"
    return [
        ("finished", f"{100 * r.finished:.0f} % of {r.rollouts}", span),
        ("and never 0.5 m off", f"{100 * r.finished_in_place:.0f} %", "in the room"),
        ("survived", f"{r.survived_s:.2f} s", f"of {r.duration_s:.2f} s"),
        ("body error", f"{r.body_error_mm:.0f} mm", f"+-{r.body_error_half_mm:.1f} at 95 %, root-relative"),
        ("error in the room", f"{r.global_error_mm:.0f} mm", ""),
        ("joint error", f"{r.joint_error_rad:.3f} rad", "mean over joints"),
        ("failures", ", ".join(f"{k} {v}" for k, v in r.causes.items() if v) or "none", ""),
        ("hardest", f"second {hard.at_s:.0f}: {failed}", f"body error {hard.body_error_mm or 0.0:.0f} mm there"),
        *((name.replace("_", " "), f"{value:+.3f}", "of the reward, mean") for name, value in r.terms.items()),
    ]
