"""`dance-train`: a reference in, a policy bundle with its curves and a recording out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from cli.terminal import BELOW_GATE, DONE, REFUSED, Out, command, progress
from robot_models import DanceError, RobotModel, load_robot
from tracking import TrackingError, TrainConfig

if TYPE_CHECKING:
    from tracking import ReferenceCheck
    from tracking.task import Piece
    from tracking.training import Run

GATE = 0.95  # share of rollouts that shall finish


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Train a policy that performs a reference; no GPU needed.

    Writes a folder: policy.onnx + contract.json (the bundle), checkpoint.pt, curves.csv, TensorBoard events and a
    Rerun recording of the policy beside the ghost of its reference.

    Examples:
        dance-train --ref out.npz
        dance-train --ref out.npz --check-ref
        dance-train --ref out.npz --minutes 2
        dance-train --ref out.npz -o runs/groove --resume
        dance-train --ref verse.npz chorus.npz -o runs/song
        dance-train --ref references -o runs/all --steps 50000000
        tensorboard --logdir runs
        torchrun --nproc-per-node 2 --no-python dance-train --ref out.npz
    """

    ref: tuple[Path, ...]
    """The reference (.npz) that dance-retarget wrote; or several of one robot, or a folder of them, for one policy."""
    robot: str | None = None
    """Its robot, where the reference's is not a built-in one (path of a profile), or a folder has several robots'."""
    out: Out = None
    """Folder of the run, which is the bundle; of several references each has its bundle inside. Default:
    runs/<reference>."""
    steps: int = TrainConfig.steps
    """Budget in control steps of all environments together; the schedules run over it."""
    minutes: float = TrainConfig.minutes
    """Stop after this much time, whatever the steps."""
    envs: int = TrainConfig.envs
    """Environments side by side."""
    seed: int = TrainConfig.seed
    """Seed of everything random."""
    threads: int = TrainConfig.threads
    """Threads of physics and networks; 0: as many as this process may use."""
    engine: Literal["mujoco", "warp"] = "mujoco"
    """Physics of the training: MuJoCo on the processor's cores, or MuJoCo-Warp on a CUDA device (extra gpu)."""
    target: float = TrainConfig.target
    """Stop early when this share of evaluation rollouts finishes (of several dances in each), twice in a row."""
    randomisation: bool = True
    """Give every environment a robot of its own (friction, masses, gains, motors, biases, delays) and pushes."""
    resume: bool = False
    """Go on from the run's checkpoint."""
    recording: bool = True
    """Write a Rerun recording at the end."""
    check_ref: bool = False
    """Only play the reference: perfectly, and with zero action. No training."""
    anyway: bool = False
    """Train on a reference whose gates failed."""


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-train`."""
    return command(Arguments, run, name="dance-train", argv=argv)


def run(args: Arguments) -> int:
    """Load, train, report."""
    from tracking import check_reference, train
    from tracking.training import started_by_torchrun

    together, follows = started_by_torchrun()
    console = Console(highlight=False, soft_wrap=True, quiet=follows)
    robot, pieces = _pieces(args, console)
    if args.check_ref:
        codes = []
        for piece in pieces:
            if len(pieces) > 1:
                console.print(f"\n{piece.name}", markup=False)
            codes.append(_check(console, check_reference(piece.reference, robot, threads=args.threads)))
        return max(codes)
    first = args.ref[0].resolve()
    name = first.name if first.is_dir() else first.stem
    folder = args.out or Path("runs") / (name if len(args.ref) == 1 else f"{len(pieces)}_references")
    for piece in pieces:
        if piece.reference.joint_torque is None:
            console.print(
                f"[yellow]no torques in {piece.name}[/]: it was made without Pinocchio, or by an earlier release; zero "
                "action will fall sooner and learning take longer. Retarget the clip again to have them."
            )
        console.print(f"{piece.name}: {piece.reference.duration_s:.1f} s for {robot.name}", markup=False)
    console.print(f"run in {folder}", markup=False)
    try:
        with progress("steps") as tell:
            result = train(
                robot, pieces, folder, _config(args), resume=args.resume,
                progress=None if follows else lambda done, total, note: tell("train", done, total, note),
            )  # fmt: skip
    except RuntimeError:
        if follows:  # the leader is gone, and has said why
            return REFUSED
        raise
    if follows:
        return DONE
    if args.recording:
        _record(folder / "training.rrd", robot, pieces, result)
    code = _summary(console, result)
    return DONE if together else code  # torchrun takes every other code for a crash


def _pieces(args: Arguments, console: Console) -> tuple[RobotModel, list[Piece]]:
    """The references; what a folder has besides, of other robots or below a gate, is left out and told."""
    from tracking.task import check_together

    files = [f for path in args.ref for f in (sorted(path.glob("*.npz")) if path.is_dir() else [path])]
    pieces = {file: _piece(file, named=file in args.ref) for file in files}
    robots = {file: piece.reference.robot for file, piece in pieces.items() if piece}
    found = sorted(set(robots.values()))
    if not found:
        raise TrackingError(
            f"--ref {' '.join(map(str, args.ref))}", found="no reference",
            expected="files (.npz) that dance-retarget wrote",
        )  # fmt: skip
    if len(found) > 1 and args.robot is None:
        raise TrackingError(
            f"--ref {args.ref[0]}", found=f"references of {', '.join(found)}", expected="one robot's", cure="name it",
            option="robot", suggestion=found[0],
        )  # fmt: skip
    robot = load_robot(args.robot or found[0])
    kept = []
    for file, piece in pieces.items():
        named = file in args.ref
        if piece is None or (piece.reference.robot != robot.name and not named):
            console.print(f"[yellow]left out[/] {file.name}: {robots.get(file, 'no reference')}, not {robot.name}")
            continue
        missed = piece.reference.failed_gates
        if not missed or args.anyway or args.check_ref:
            kept.append(piece)
        elif named:
            raise TrackingError(
                str(file), found=f"gates that failed: {', '.join(missed)}", expected="a reference inside its gates",
                cure="cut the clip or choose another robot", option="anyway", suggestion=" ",
            )  # fmt: skip
        else:
            console.print(f"[yellow]left out[/] {file.name}: gates that failed: {', '.join(missed)}")
    if not kept:
        raise TrackingError(
            f"--ref {args.ref[0]}", found=f"no reference of {robot.name} inside its gates", expected="one at least",
            option="anyway", suggestion=" ",
        )  # fmt: skip
    check_together(kept, robot)
    return robot, kept


def _piece(file: Path, *, named: bool) -> Piece | None:
    """A reference; None for a file that is none, which is refused where it was named."""
    from tracking.task import read_piece

    try:
        return read_piece(file)
    except DanceError:
        if named:
            raise
        return None


def _check(console: Console, found: ReferenceCheck) -> int:
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_row("gates that failed", ", ".join(found.failed_gates) or "none", "when it was retargeted")
    table.add_row("frames beyond joint limits", f"{100 * found.beyond_limits:.1f} %", "")
    table.add_row("frames over motor speed", f"{100 * found.too_fast:.1f} %", "")
    table.add_row("perfect tracking earns", f"{100 * found.perfect:.1f} %", "of the largest reward")
    table.add_row("first pose, held for 1 s", f"{1e3 * found.settles_m:.1f} mm", "that the pelvis sinks")
    table.add_row("zero action survives", f"{found.survived_s:.2f} s", "mean over starts all along the dance")
    console.print(table)
    console.print("[green]worth training on[/]" if found.passed else "[red]below the gate[/]")
    return DONE if found.passed else BELOW_GATE


def _config(args: Arguments) -> TrainConfig:
    base = TrainConfig(
        steps=args.steps,
        minutes=args.minutes,
        envs=args.envs,
        seed=args.seed,
        threads=args.threads,
        target=args.target,
        engine=args.engine,
    )
    draw = replace(base.task.randomisation, enabled=args.randomisation)
    return replace(base, task=replace(base.task, randomisation=draw))


def _record(path: Path, robot: RobotModel, pieces: list[Piece], result: Run) -> None:
    """The curves, and the policy beside its ghost: of several pieces in the one that finishes least often."""
    from cli.recordings import save_rollouts

    if not result.evaluations:
        return
    piece = min(pieces, key=lambda p: result.evaluations[p.name].finished)
    steps = np.array([row["steps"] for row in result.curves])
    names = {"survived_s": "survived [s]", "finished": "finished [share]", "body_error_mm": "body error [mm]"}
    curves = {label: (steps, np.array([row[key] for row in result.curves])) for key, label in names.items()}
    best = result.evaluations[piece.name].best
    save_rollouts(path, robot, piece.reference, {"policy": best}, curves, _text(result))


def _text(result: Run) -> str:
    rows = [
        f"| {r['steps'] / 1e6:.2f} M | {r['minutes']:.1f} | {r['survived_s']:.2f} | {100 * r['finished']:.0f} % | "
        f"{r['body_error_mm']:.0f} |"
        for r in result.curves
    ]
    return "\n".join(
        ["# Learning", "| steps | min | survived [s] | finished | body error [mm] |", "|---|---|---|---|---|", *rows]
    )


def _summary(console: Console, result: Run) -> int:
    if not result.curves:
        console.print(result.stopped)
        return BELOW_GATE
    first, last = result.curves[0], result.curves[-1]
    console.print(f"{result.stopped}: {result.steps} steps in {result.seconds / 60:.1f} min")
    duration = np.mean([e.duration_s for e in result.evaluations.values()]) if result.evaluations else float("nan")
    console.print(
        f"survives {first['survived_s']:.2f} s -> [bold]{last['survived_s']:.2f} s[/] of {duration:.2f} s; "
        f"{100 * last['finished']:.0f} % of rollouts finish{'' if len(result.evaluations) < 2 else ' the dance learnt least'}; "
        f"body error {last['body_error_mm']:.0f} mm"
    )
    if len(result.evaluations) > 1:
        for name, e in sorted(result.evaluations.items(), key=lambda pair: pair[1].finished):
            console.print(
                f"  {name}: {100 * e.finished:.0f} % of {e.rollouts} finish, survives {e.survived_s:.2f} of "
                f"{e.duration_s:.2f} s, body error {e.body_error_mm:.0f} mm", markup=False,
            )  # fmt: skip
    console.print(f"onnxruntime agrees with torch to {result.onnx_difference:.1e}")
    for name in ("policy.onnx", "contract.json", "curves.csv", "checkpoint.pt", "training.rrd"):
        path = result.folder / name
        if path.exists():
            hint = f"   open it: rerun {path}" if path.suffix == ".rrd" else ""
            console.print(f"wrote {path}{hint}", markup=False)
    if last["finished"] >= GATE:
        return DONE
    console.print(
        f"[red]below the gate[/]: {100 * GATE:.0f} % of rollouts shall finish; go on with --resume --steps MORE"
    )
    return BELOW_GATE
