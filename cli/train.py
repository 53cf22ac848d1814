"""`dance-train`: a reference in, a policy bundle with its curves and a recording out."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from cli.judging import as_references
from cli.shell import DONE, GATE, REFUSED, command, line, progress, tell
from cli.training import (
    Arguments,
    as_begun,
    check_table,
    check_verdict,
    keep_beginning,
    print_plan,
    print_tracker,
    run_details,
    run_verdict,
    slower,
    teacher_of,
)
from clips import is_reference
from robot_models.maths import silent

if TYPE_CHECKING:
    from tracking import Run
    from tracking.task import Selection


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-train`."""
    return command(Arguments, run, name="dance-train", argv=argv)


def run(args: Arguments) -> int:
    """Load, train, report."""
    from tracking import AUTO, NOBODY, named_teacher, refuse_missing_run, refuse_run_that_is_there
    from tracking.task import select_references

    args.numbers()  # what is wrong with them is told before anything is read
    together, follows = _started_by_torchrun()
    console = args.tell.console(quiet=follows)
    refs = as_references(args.ref, args.file, Path(), console)
    chosen = select_references(refs, args.robot, below_gates=args.anyway or args.check_ref)
    for file, why in chosen.left_out:
        console.print(f"left out {file.name}: {why}", style="yellow")
    if args.check_ref:
        return _check(args, chosen)
    first = refs[0].resolve()
    name = first.name if first.is_dir() else first.stem
    folder = args.out or Path("runs") / (name if len(args.ref) == 1 else f"{len(chosen.pieces)}_references")
    if args.resume:
        refuse_missing_run(folder)
        args = as_begun(args, folder)
    else:
        refuse_run_that_is_there(folder)
    if args.teacher not in (AUTO, NOBODY):
        named_teacher(args.teacher)
    teacher = teacher_of(args, chosen, together)
    keep_beginning(args, folder, teacher)
    print_plan(console, chosen, folder, teacher)
    if teacher is not None and not args.resume:
        from tracking.teaching import judge_tracker

        print_tracker(console, judge_tracker(teacher, chosen.robot, chosen.pieces, args.numbers()), GATE)
    try:
        result = _train(args, chosen, folder, teacher, follows)
    except RuntimeError:
        if follows:  # the leader is gone, and has said why
            return REFUSED
        raise
    if follows:
        return DONE
    if args.recording:
        from cli.recordings import save_training

        save_training(folder / "training.rrd", chosen.robot, chosen.pieces, result)
    code = tell(run_verdict(result, refs, args.robot), args.tell, run_details(result))
    return DONE if together else code  # torchrun takes every other code for a crash


def _started_by_torchrun() -> tuple[bool, bool]:
    """Whether this process is one of several, and whether it follows another."""
    several = int(os.environ.get("WORLD_SIZE", "1")) > 1
    return several, several and int(os.environ.get("RANK", "0")) > 0


def _check(args: Arguments, chosen: Selection) -> int:
    from tracking import check_reference

    found = {p.name: check_reference(p.reference, chosen.robot, threads=args.threads) for p in chosen.pieces}
    tables = [detail for name, check in found.items() for detail in (name, check_table(check))]
    others = [ref for ref in args.ref if ref.is_file() and not is_reference(ref)]
    solve = [line("dance-retarget", ref, "--robot", chosen.robot.name, *args.file.words()) for ref in others]
    return tell(check_verdict(found, solve, slower(args.ref, args.robot or chosen.robot.name)), args.tell, tables)


def _train(args: Arguments, chosen: Selection, folder: Path, teacher: Path | None, follows: bool) -> Run:
    from cli.viewing import training_page
    from tracking import teach, train
    from tracking.training import nobody_looks

    page = training_page(chosen.robot, chosen.pieces) if args.view and not follows else nullcontext(nobody_looks)
    with page as judged, progress("steps") as tell:
        told, numbers, more = silent if follows else tell, args.numbers(), args.resume
        what = chosen.robot, chosen.pieces, folder
        if teacher is None:
            return train(*what, numbers, begin=args.begin, resume=more, progress=told, judged=judged)
        return teach(*what, teacher, numbers, begin=args.begin, resume=more, progress=told, judged=judged)
