"""`dance-eval --sweep`: one thing changed at a time, in every engine, as a table and a picture."""

from __future__ import annotations

import json

from rich.console import Console

from cli.evaluating.arguments import Arguments
from cli.evaluating.tables import brief, grid
from cli.shell import BELOW_GATE, DONE, GATE, progress, write_text


def run_sweep(args: Arguments, engines: tuple[str, ...], console: Console) -> int:
    """Evaluate under every condition; the first one's success decides."""
    from robot_models.maths import available_threads
    from tracking import sweep
    from tracking.evaluation import by_condition

    with progress("cells") as tell:
        cells = sweep(
            args.bundle, engines, rollouts=args.rollouts, seed=args.seed, jobs=args.jobs or available_threads(),
            reference=args.ref, robot=args.robot,
            progress=tell,
        )  # fmt: skip
    rows = by_condition(cells)
    console.print(grid(engines, {c: [brief(row[name].result) for name in engines] for c, row in rows.items()}))
    if args.json is not None:
        write_text(args.json, json.dumps([cell.as_dict() for cell in cells], indent=1), console)
    if args.picture is not None:
        from cli.recordings import save_sweep

        save_sweep(args.picture, rows, engines, f"{args.bundle.name}: rollouts that finish [%]")
        console.print(f"wrote {args.picture}")
    first = next(iter(rows.values()))
    return DONE if all(cell.result.finished >= GATE for cell in first.values()) else BELOW_GATE
