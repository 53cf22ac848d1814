"""`dance-eval`: how well a trained policy performs its reference, over many rollouts, in one engine or several."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from cli.evaluating import Arguments, brief, grid, outcome_line, rows_of, run_sweep, side_by_side, verdict_of
from cli.shell import GATE, Verdict, command, progress, tell
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
    engines = engine_names(args.engine)
    inside = sorted(p.parent for p in args.bundle.glob(f"*/{CONTRACT}")) if args.bundle.is_dir() else []
    if inside and not (args.bundle / CONTRACT).exists():
        return _each(args, inside, engines)
    bundle = load_bundle(args.bundle, reference=args.ref, robot=args.robot)
    golden = _check_golden(bundle)
    if args.sweep:
        return run_sweep(args, engines)
    results = _evaluate(args, args.bundle, engines)
    lines = side_by_side({name: rows_of(result) for name, result in results.items()})
    table = Table(*lines[0], box=None, pad_edge=False, header_style="bold")
    for line in lines[1:]:
        table.add_row(*line)
    if args.recording is not None:
        from cli.recordings import save_evaluation

        save_evaluation(args.recording, bundle, results, str(args.bundle), lines)
    return tell(verdict_of(results, args, (golden,)), args.tell, [table])


def _check_golden(bundle: Bundle) -> str:
    """Whether the policy does here what it did in training, as far as it brings a trace."""
    from tracking import read_golden, replay
    from tracking.policy import GOLDEN

    if bundle.contract.follows_any:
        return "a tracker, which follows any reference"
    if bundle.contract.robot_hash:
        return f"golden trace repeated to {replay(bundle.runner, read_golden(bundle.folder / GOLDEN)):.1e}"
    return f"another tool's policy: {bundle.contract.source}"


def _each(args: Arguments, folders: list[Path], engines: tuple[str, ...]) -> int:
    """One policy that dances several references: a row for each."""
    _check_each(args, folders)
    results = {folder.name: _evaluate(args, folder, engines) for folder in folders}
    cells: dict[str, list[str | Text]] = {
        n: [f"{r[engines[0]].duration_s:.1f}", *(brief(r[e]) for e in engines)] for n, r in results.items()
    }
    name, worst = min(
        ((f"{dance} in {engine}", result) for dance, row in results.items() for engine, result in row.items()),
        key=lambda pair: pair[1].finished,
    )
    verdict = Verdict(
        passed=worst.finished >= GATE,
        line=f"{args.bundle.name}, {len(folders)} dances; least {name}: {outcome_line(worst)}",
        data={"results": {n: {engine: r.as_dict() for engine, r in row.items()} for n, row in results.items()}},
    )
    return tell(verdict, args.tell, shown=[grid(("s", *engines), cells)])


def _check_each(args: Arguments, folders: list[Path]) -> None:
    """Refuse what is meant for one dance, and folders of different policies."""
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
