"""`dance-eval --sweep`: one thing changed at a time, in every engine, as a table and a picture."""

from __future__ import annotations

from cli.evaluating.arguments import Arguments
from cli.evaluating.tables import brief, grid
from cli.shell import GATE, Verdict, progress, tell


def run_sweep(args: Arguments, engines: tuple[str, ...]) -> int:
    """Evaluate under every condition; the first one's success decides."""
    from robot_models.maths import available_threads
    from tracking import sweep
    from tracking.evaluation import by_condition

    with progress("cells") as follow:
        cells = sweep(
            args.bundle, engines, rollouts=args.rollouts, seed=args.seed, jobs=args.jobs or available_threads(),
            reference=args.ref, robot=args.robot,
            progress=follow,
        )  # fmt: skip
    rows = by_condition(cells)
    table = grid(engines, {c: [brief(row[name].result) for name in engines] for c, row in rows.items()})
    if args.picture is not None:
        from cli.recordings import save_sweep

        save_sweep(args.picture, rows, engines, f"{args.bundle.name}: rollouts that finish [%]")
    first, least = next(iter(rows)), min(cells, key=lambda cell: cell.result.finished)
    passed = all(cell.result.finished >= GATE for cell in rows[first].values())
    share = min(cell.result.finished for cell in rows[first].values())
    verdict = Verdict(
        passed=passed,
        line=f"{args.bundle.name}: {100 * share:.0f} % finish {first}; "
        f"least, {100 * least.result.finished:.0f} %, with {least.condition} in {least.engine}",
        written=() if args.picture is None else (args.picture,),
        data={"cells": [cell.as_dict() for cell in cells]},
    )
    return tell(verdict, args.tell, shown=[table])
