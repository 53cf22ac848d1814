"""Rollouts in one engine after another, of one dance or of each that a policy knows."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from cli.evaluating.arguments import Arguments
from cli.evaluating.tables import brief, grid
from cli.evaluating.verdict import outcome_line
from cli.shell import GATE, Verdict, progress, tell
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking import Evaluation


def evaluate_each(args: Arguments, dances: Mapping[str, Arguments], engines: tuple[str, ...]) -> int:
    """One policy that dances several references: a row for each.

    Args:
        args: as they were given.
        dances: by the name of each dance what judges it alone: its own bundle, or the tracker with a reference.
        engines: in which.
    """
    _check_each(args, dances)
    results = {name: evaluate_in(alone, alone.bundle, engines) for name, alone in dances.items()}
    cells: dict[str, list[str | Text]] = {
        n: [f"{r[engines[0]].duration_s:.1f}", *(brief(r[e]) for e in engines)] for n, r in results.items()
    }
    name, worst = min(
        ((f"{dance} in {engine}", result) for dance, row in results.items() for engine, result in row.items()),
        key=lambda pair: pair[1].finished,
    )
    verdict = Verdict(
        passed=worst.finished >= GATE,
        line=f"{args.bundle.name}, {len(dances)} dances; least {name}: {outcome_line(worst)}",
        data={"results": {n: {engine: r.as_dict() for engine, r in row.items()} for n, row in results.items()}},
    )
    return tell(verdict, args.tell, shown=[grid(("s", *engines), cells)])


def _check_each(args: Arguments, dances: Mapping[str, Arguments]) -> None:
    """Refuse what is meant for one dance, and folders of different policies."""
    from tracking import load_bundle, read_golden, replay
    from tracking.policy import GOLDEN, POLICY

    alone = {"--ref": args.ref, "--sweep": args.sweep, "--recording": args.recording, "--picture": args.picture}
    first, one = next(iter(dances.items()))
    known = one.bundle == args.bundle
    if any(alone.values()):
        raise TrackingError(
            ", ".join(name for name, given in alone.items() if given), found=f"{len(dances)} dances", expected="one of them",
            cure=f"name it, as {f'--dance {first}' if known else one.bundle}",
        )  # fmt: skip
    if known:
        return
    folders = [each.bundle for each in dances.values()]
    if len({(folder / POLICY).read_bytes() for folder in folders}) > 1:
        raise TrackingError(
            str(args.bundle), found=f"{len(folders)} bundles of different policies", expected="one policy's",
            cure=f"name one, as {folders[0]}",
        )  # fmt: skip
    for folder in folders:
        replay(load_bundle(folder, robot=args.robot).runner, read_golden(folder / GOLDEN))


def evaluate_in(args: Arguments, folder: Path, engines: tuple[str, ...]) -> dict[str, Evaluation]:
    """The evaluation of one dance by engine."""
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
