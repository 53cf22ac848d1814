"""What a run and a reference came to, for the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from tracking import Evaluation, ReferenceCheck, Run
    from tracking.task import Selection


def print_check(console: Console, found: ReferenceCheck) -> None:
    """What the check of a reference found."""
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_row("gates that failed", ", ".join(found.failed_gates) or "none", "when it was retargeted")
    table.add_row("frames beyond joint limits", f"{100 * found.beyond_limits:.1f} %", "")
    table.add_row("frames over motor speed", f"{100 * found.too_fast:.1f} %", "")
    table.add_row("perfect tracking earns", f"{100 * found.perfect:.1f} %", "of the largest reward")
    table.add_row("first pose, held for 1 s", f"{1e3 * found.settles_m:.1f} mm", "that the pelvis sinks")
    table.add_row("zero action survives", f"{found.survived_s:.2f} s", "mean over starts all along the dance")
    console.print(table)
    said, style = ("worth training on", "green") if found.passed else ("below the gate", "red")
    console.print(said, style=style)


def print_plan(console: Console, chosen: Selection, folder: Path, teacher: Path | None) -> None:
    """What will be learnt, from whom, and where it goes."""
    for piece in chosen.pieces:
        if piece.reference.joint_torque is None:
            console.print(
                f"no torques in {piece.name}: it was made without Pinocchio, or by an earlier release; zero action will fall "
                "sooner and learning take longer. Retarget the clip again to have them.",
                style="yellow",
            )
        console.print(f"{piece.name}: {piece.reference.duration_s:.1f} s for {chosen.robot.name}")
    taught = f"taught by {teacher}" if teacher else "nobody teaches: the policy finds out by itself (docs/training.md)"
    console.print(f"{taught}\nrun in {folder}")


def print_tracker(console: Console, found: dict[str, Evaluation], gate: float) -> None:
    """How well a tracker dances references that nobody taught it."""
    for name, e in found.items():
        known = "dances it already; teaching makes it tighter" if e.finished >= gate else "does not dance it all"
        console.print(
            f"{name}, untaught: {100 * e.finished:.0f} % of {e.rollouts} finish, {100 * e.stood:.0f} % do not fall, "
            f"{e.body_error_mm:.0f} mm: the tracker {known}",
        )  # fmt: skip


def print_run(console: Console, result: Run, gate: float) -> None:
    """How far the policy came, of every dance, and the files."""
    if not result.curves:
        console.print(result.stopped)
        return
    first, last = result.curves[0], result.outcome
    console.print(f"{result.stopped}: {result.steps} steps in {result.seconds / 60:.1f} min")
    lengths = [e.duration_s for e in result.evaluations.values()]
    duration = sum(lengths) / len(lengths) if lengths else float("nan")
    console.print(
        f"survives {first['survived_s']:.2f} s -> {last['survived_s']:.2f} s of {duration:.2f} s; "
        f"{100 * last['finished']:.0f} % of rollouts finish{'' if len(result.evaluations) < 2 else ' the dance learnt least'}; "
        f"body error {last['body_error_mm']:.0f} mm"
    )
    if len(result.evaluations) > 1:
        for name, e in sorted(result.evaluations.items(), key=lambda pair: pair[1].finished):
            console.print(
                f"  {name}: {100 * e.finished:.0f} % of {e.rollouts} finish, survives {e.survived_s:.2f} of "
                f"{e.duration_s:.2f} s, body error {e.body_error_mm:.0f} mm",
            )  # fmt: skip
    console.print(f"onnxruntime agrees with torch to {result.onnx_difference:.1e}")
    for name in ("policy.onnx", "contract.json", "curves.csv", "checkpoint.pt", "training.rrd"):
        path = result.folder / name
        if path.exists():
            hint = f"   open it: rerun {path}" if path.suffix == ".rrd" else ""
            console.print(f"wrote {path}{hint}")
    if last["finished"] < gate:
        console.print(
            f"below the gate: {100 * gate:.0f} % of rollouts shall finish; go on with --resume --steps MORE",
            style="red",
        )
