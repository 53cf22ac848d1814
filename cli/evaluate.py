"""`dance-eval`: how well a trained policy performs its reference, over many rollouts, in one engine or several."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from cli.terminal import BELOW_GATE, DONE, ClipPath, command, progress
from cli.train import GATE
from clips import write_whole
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking import Cell, Evaluation


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Roll out a policy bundle over its whole dance and count how often it finishes.

    The policy is played by the runner that stands on a robot: it knows the bundle alone, and first has to repeat the
    golden trace of the training.

    Examples:
        dance-eval groove-g1
        dance-eval groove-g1 --engine all --recording both.rrd
        dance-eval runs/groove --rollouts 500 --json result.json
        dance-eval groove-g1 --engine all --sweep --picture sweep.png
        dance-eval runs/song
    """

    bundle: ClipPath
    """Folder that dance-train wrote (policy.onnx, contract.json, golden.npz, reference.npz; of a policy that dances
    several references, the run's folder: a row for each), or groove-dancer or
    groove-g1, which come with the package. Also another tool's policy: an ONNX with BeyondMimic's metadata, or Unitree's
    deploy.yaml with its policy.onnx beside it."""
    ref: Path | None = None
    """The reference that it shall perform, where it does not lie in the bundle."""
    robot: str | None = None
    """Its robot, or the path of a profile, where the policy does not say."""
    engine: str = "mujoco"
    """mujoco; physx-isaac (PhysX 5 as Isaac Lab trains, implicit drives at 5 ms); physx-motor (PhysX 5 with the servo
    law of motor boards, clipped torques at 1 ms); physx for both of these, all for all three. PhysX needs the extra
    sim2sim. warp: MuJoCo-Warp, the extra gpu."""
    rollouts: int = 100
    """How many, each with its own noise and robot."""
    seed: int = 1
    """Seed of noise and robots."""
    randomisation: bool = True
    """Draw every rollout's robot from the training ranges; otherwise the nominal one."""
    sweep: bool = False
    """Change one thing at a time (delay, gains, friction, mass, pushes, sensors) and evaluate under each."""
    jobs: int = 0
    """Processes of a sweep; 0: as many as the cores that this process may use."""
    picture: Path | None = None
    """Write the sweep's table as a picture here."""
    json: Path | None = None
    """Write the numbers here too."""
    recording: Path | None = None
    """Write a Rerun recording of the longest rollout in each engine here."""


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-eval`."""
    return command(Arguments, run, name="dance-eval", argv=argv)


def run(args: Arguments) -> int:
    """Load, check, roll out, report."""
    from tracking import engine_names, load_bundle, read_golden, replay
    from tracking.policy import CONTRACT, GOLDEN

    if args.rollouts < 1:
        raise TrackingError("--rollouts", found=str(args.rollouts), expected="at least 1")
    console = Console(highlight=False, soft_wrap=True)
    engines = engine_names(args.engine)
    inside = sorted(p.parent for p in args.bundle.glob(f"*/{CONTRACT}")) if args.bundle.is_dir() else []
    if inside and not (args.bundle / CONTRACT).exists():
        return _each(args, inside, engines, console)
    bundle = load_bundle(args.bundle, reference=args.ref, robot=args.robot)
    if bundle.contract.robot_hash:
        apart = replay(bundle.runner, read_golden(bundle.folder / GOLDEN))
        console.print(f"golden trace repeated to {apart:.1e}", markup=False)
    else:
        console.print(f"another tool's policy: {bundle.contract.source}", markup=False)
    if args.sweep:
        return _sweep(args, engines, console)
    results = _evaluate(args, args.bundle, engines)
    tables = {name: _rows(result) for name, result in results.items()}
    lines = _side_by_side(tables)
    table = Table(*lines[0], box=None, pad_edge=False, header_style="bold")
    for line in lines[1:]:
        table.add_row(*line)
    console.print(table)
    if args.json is not None:
        told: dict[str, Any] = {name: result.as_dict() for name, result in results.items()}
        _write(args.json, json.dumps(told if len(told) > 1 else next(iter(told.values())), indent=1), console)
    if args.recording is not None:
        from cli.recordings import save_rollouts

        rule = "|---" * len(lines[0]) + "|"
        rows = [f"| {' | '.join(line)} |" for line in lines]
        text = "\n".join([f"# {args.bundle}", rows[0], rule, *rows[1:]])
        save_rollouts(args.recording, bundle.robot, bundle.reference, {n: r.best for n, r in results.items()}, {}, text)
        console.print(f"wrote {args.recording}   open it: rerun {args.recording}", markup=False)
    return DONE if all(r.finished >= GATE for r in results.values()) else BELOW_GATE


def _each(args: Arguments, folders: list[Path], engines: tuple[str, ...], console: Console) -> int:
    """One policy that dances several references: a row for each."""
    from tracking import load_bundle, read_golden, replay
    from tracking.policy import GOLDEN, POLICY

    alone = {"--ref": args.ref, "--sweep": args.sweep, "--recording": args.recording, "--picture": args.picture}
    if any(alone.values()):
        raise TrackingError(
            ", ".join(name for name, given in alone.items() if given), found=f"a run of {len(folders)} dances",
            expected="the bundle of one of them", cure=f"name it, as {folders[0]}",
        )  # fmt: skip
    if len({(folder / POLICY).read_bytes() for folder in folders}) > 1:
        raise TrackingError(
            str(args.bundle), found=f"{len(folders)} bundles of different policies", expected="one policy's",
            cure=f"name one, as {folders[0]}",
        )  # fmt: skip
    for folder in folders:
        replay(load_bundle(folder, robot=args.robot).runner, read_golden(folder / GOLDEN))
    results = {folder.name: _evaluate(args, folder, engines) for folder in folders}
    table = Table(box=None, pad_edge=False, header_style="bold", title="finished %, survived s, body error mm")
    for column in ("", "s", *engines):
        table.add_column(column, justify="left" if not column else "right")
    for name, row in results.items():
        table.add_row(name, f"{row[engines[0]].duration_s:.1f}", *(_short(row[engine]) for engine in engines))
    console.print(table)
    if args.json is not None:
        told = {name: {engine: result.as_dict() for engine, result in row.items()} for name, row in results.items()}
        _write(args.json, json.dumps(told, indent=1), console)
    every = [result for row in results.values() for result in row.values()]
    return DONE if all(result.finished >= GATE for result in every) else BELOW_GATE


def _evaluate(args: Arguments, folder: Path, engines: tuple[str, ...]) -> dict[str, Evaluation]:
    from tracking import ENGINES, TaskConfig, evaluate, evaluation_task, load_bundle

    results = {}
    with progress("steps") as tell:
        for name in engines:
            bundle = load_bundle(folder, reference=args.ref, robot=args.robot)
            task = evaluation_task(TaskConfig(), randomised=args.randomisation)
            results[name] = evaluate(
                bundle.runner, bundle.robot, bundle.reference, task, rollouts=args.rollouts, seed=args.seed,
                engine=ENGINES[name], progress=lambda done, total, name=name: tell(name, done, total),  # type: ignore[misc]
            )  # fmt: skip
    return results


def _sweep(args: Arguments, engines: tuple[str, ...], console: Console) -> int:
    from robot_models.maths import available_threads
    from tracking import sweep

    with progress("cells") as tell:
        cells = sweep(
            args.bundle, engines, rollouts=args.rollouts, seed=args.seed, jobs=args.jobs or available_threads(),
            reference=args.ref, robot=args.robot,
            progress=lambda done, total: tell("sweep", done, total),
        )  # fmt: skip
    table = Table(box=None, pad_edge=False, header_style="bold", title="finished %, survived s, body error mm")
    for column in ("", *engines):
        table.add_column(column, justify="left" if not column else "right")
    for condition, row in by_condition(cells).items():
        table.add_row(condition, *(_short(row[name].result) for name in engines))
    console.print(table)
    if args.json is not None:
        _write(args.json, json.dumps([cell.as_dict() for cell in cells], indent=1), console)
    if args.picture is not None:
        from cli.recordings import save_sweep

        save_sweep(args.picture, by_condition(cells), engines, f"{args.bundle.name}: rollouts that finish [%]")
        console.print(f"wrote {args.picture}", markup=False)
    first = next(iter(by_condition(cells).values()))
    return DONE if all(cell.result.finished >= GATE for cell in first.values()) else BELOW_GATE


def by_condition(cells: list[Cell]) -> Mapping[str, Mapping[str, Cell]]:
    """Condition -> engine -> cell, in the order of the cells."""
    rows: dict[str, dict[str, Cell]] = {}
    for cell in cells:
        rows.setdefault(cell.condition, {})[cell.engine] = cell
    return rows


def _short(r: Evaluation) -> str:
    text = f"{100 * r.finished:.0f}, {r.survived_s:.1f}, {r.body_error_mm:.0f}"
    return text if r.finished >= 0.9 else f"[red]{text}[/]"


def _write(path: Path, text: str, console: Console) -> None:
    with write_whole(path) as stream:
        stream.write(text.encode())
    console.print(f"wrote {path}", markup=False)


def _side_by_side(tables: Mapping[str, list[tuple[str, str, str]]]) -> list[tuple[str, ...]]:
    """Header and lines: one column per engine, and the remarks where there is but one."""
    if len(tables) == 1:
        (name, rows), *_ = tables.items()
        return [("", name, ""), *rows]
    columns = list(tables.values())
    return [("", *tables), *((rows[0][0], *(value for _, value, _ in rows)) for rows in zip(*columns, strict=True))]


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
