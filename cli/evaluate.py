"""`dance-eval`: how well a trained policy performs its reference, over many rollouts, in one engine or several."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from cli.evaluating import Arguments, brief, grid, rows_of, run_sweep, side_by_side
from cli.shell import BELOW_GATE, DONE, GATE, command, make_console, progress, write_text
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking import Bundle, Evaluation


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-eval`."""
    return command(Arguments, run, name="dance-eval", argv=argv)


def run(args: Arguments) -> int:
    """Load, check, roll out, report."""
    from tracking import engine_names, load_bundle
    from tracking.policy import CONTRACT

    if args.rollouts < 1:
        raise TrackingError("--rollouts", found=str(args.rollouts), expected="at least 1")
    console = make_console()
    engines = engine_names(args.engine)
    inside = sorted(p.parent for p in args.bundle.glob(f"*/{CONTRACT}")) if args.bundle.is_dir() else []
    if inside and not (args.bundle / CONTRACT).exists():
        return _each(args, inside, engines, console)
    bundle = load_bundle(args.bundle, reference=args.ref, robot=args.robot)
    _check_golden(bundle, console)
    if args.sweep:
        return run_sweep(args, engines, console)
    results = _evaluate(args, args.bundle, engines)
    lines = side_by_side({name: rows_of(result) for name, result in results.items()})
    table = Table(*lines[0], box=None, pad_edge=False, header_style="bold")
    for line in lines[1:]:
        table.add_row(*line)
    console.print(table)
    if args.json is not None:
        told: dict[str, Any] = {name: result.as_dict() for name, result in results.items()}
        write_text(args.json, json.dumps(told if len(told) > 1 else next(iter(told.values())), indent=1), console)
    if args.recording is not None:
        from cli.recordings import save_evaluation

        save_evaluation(args.recording, bundle, results, str(args.bundle), lines)
        console.print(f"wrote {args.recording}   open it: rerun {args.recording}")
    return DONE if all(r.finished >= GATE for r in results.values()) else BELOW_GATE


def _check_golden(bundle: Bundle, console: Console) -> None:
    from tracking import read_golden, replay
    from tracking.policy import GOLDEN

    if bundle.contract.follows_any:
        console.print("a tracker, which follows any reference")
    elif bundle.contract.robot_hash:
        apart = replay(bundle.runner, read_golden(bundle.folder / GOLDEN))
        console.print(f"golden trace repeated to {apart:.1e}")
    else:
        console.print(f"another tool's policy: {bundle.contract.source}")


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
    cells: dict[str, list[str | Text]] = {
        n: [f"{r[engines[0]].duration_s:.1f}", *(brief(r[e]) for e in engines)] for n, r in results.items()
    }
    console.print(grid(("s", *engines), cells))
    if args.json is not None:
        told = {name: {engine: result.as_dict() for engine, result in row.items()} for name, row in results.items()}
        write_text(args.json, json.dumps(told, indent=1), console)
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
                engine=ENGINES[name], progress=lambda stage, *more, name=name: tell(f"{stage}, {name}", *more),
            )  # fmt: skip
    return results
