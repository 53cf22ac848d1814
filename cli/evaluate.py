"""`dance-eval`: how well a trained policy performs its reference, over many rollouts, in one engine or several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from cli.evaluating import (
    Arguments,
    evaluate_each,
    evaluate_in,
    on_the_beat,
    rows_of,
    run_sweep,
    side_by_side,
    verdict_of,
)
from cli.judging import followed, known_dances, names_of_known_dances
from cli.shell import command, make_folder, recording_name, tell
from clips import OutputError
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking import Bundle


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-eval`."""
    return command(Arguments, run, name="dance-eval", argv=argv)


def run(args: Arguments) -> int:
    """Load, check, roll out, report."""
    if args.rollouts < 1:
        raise TrackingError("--rollouts", found=str(args.rollouts), expected="at least 1")
    recording_name(args.recording)
    if args.write_reference is not None and args.write_reference.suffix != ".npz":
        raise OutputError(
            f"--write-reference {args.write_reference}", found="that name", expected="a file that ends in .npz"
        )
    if args.ref is None and args.dance is None:  # its own dance, or each that it knows
        return _judge(args)
    with followed(args.bundle, args.ref, args.dance, args.file, args.tell.console()) as ref:
        return _judge(replace(args, ref=ref))


def _judge(args: Arguments) -> int:
    from tracking import engine_names, load_bundle
    from tracking.policy import CONTRACT

    engines = engine_names(args.engine)
    inside = sorted(p.parent for p in args.bundle.glob(f"*/{CONTRACT}")) if args.bundle.is_dir() else []
    each = bool(inside) and not (args.bundle / CONTRACT).exists()
    knows = args.ref is None and bool(names_of_known_dances(args.bundle))
    if args.write_reference is not None and (each or knows or args.sweep):
        raise TrackingError(
            "--write-reference", found="a sweep, or policies of several dances", expected="one policy of one dance"
        )
    if each:
        return evaluate_each(args, {folder.name: replace(args, bundle=folder) for folder in inside}, engines)
    if knows:
        with known_dances(args.bundle) as files:
            return evaluate_each(args, {name: replace(args, ref=file) for name, file in files.items()}, engines)
    bundle = load_bundle(args.bundle, reference=args.ref, robot=args.robot)
    golden = _check_golden(bundle)
    if args.sweep:
        return run_sweep(args, engines)
    results = evaluate_in(args, args.bundle, engines)
    lines = side_by_side({name: rows_of(result) for name, result in results.items()})
    table = Table(*lines[0], box=None, pad_edge=False, header_style="bold")
    for line in lines[1:]:
        table.add_row(*line)
    if args.recording is not None:
        from cli.recordings import save_evaluation

        save_evaluation(args.recording, bundle, results, str(args.bundle), lines)
    out = args.write_reference
    notes = (golden, *on_the_beat(bundle, results), *([_write_danced(args, out)] if out is not None else []))
    return tell(verdict_of(results, args, notes), args.tell, [table])


def _write_danced(args: Arguments, out: Path) -> str:
    """Write what the robot makes of its reference, and say what it is worth."""
    from tracking.evaluation import danced_reference

    danced = danced_reference(args.bundle, args.robot, args.ref, args.seed)
    make_folder(out)
    danced.save(out)
    missed = ", ".join(m.label for m in danced.report.failures)
    return f"as it was danced: {f'gates missed: {missed}' if missed else 'every gate holds'}"


def _check_golden(bundle: Bundle) -> str:
    """Whether the policy does here what it did in training, as far as it brings a trace."""
    from tracking import read_golden, replay
    from tracking.policy import GOLDEN

    if bundle.contract.follows_any:
        return "a tracker, which follows any reference"
    if bundle.contract.robot_hash:
        return f"golden trace repeated to {replay(bundle.runner, read_golden(bundle.folder / GOLDEN)):.1e}"
    return f"another tool's policy: {bundle.contract.source}"
