"""What an evaluation came to: how many finish, stray and fall, by which rule, and what to type next."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cli.evaluating.arguments import Arguments
from cli.shell import GATE, Trouble, Verdict, again, line

if TYPE_CHECKING:
    from tracking import Evaluation


def outcome_line(result: Evaluation) -> str:
    """`96 of 100 finish (90 to 98 %), 1 strays, 3 fall`."""
    finished, strayed, fell = (result.outcomes[name] for name in ("finished", "strayed", "fell"))
    low, high = finished.interval
    return (
        f"{finished.count} of {finished.of} finish ({100 * low:.0f} to {100 * high:.0f} % at 95 %), "
        f"{strayed.count} stray{'s' * (strayed.count == 1)}, {fell.count} fall{'s' * (fell.count == 1)}"
    )


def verdict_of(results: Mapping[str, Evaluation], args: Arguments, notes: tuple[str, ...] = ()) -> Verdict:
    """The verdict on one policy and one dance, in one engine or several; the worst engine decides.

    Args:
        results: by engine.
        args: what was asked for.
        notes: what was found out about the policy.
    """
    engine, worst = min(results.items(), key=lambda pair: pair[1].finished)
    passed = worst.finished >= GATE
    others = tuple(f"{name}: {outcome_line(r)}" for name, r in results.items() if name != engine)
    written = tuple(path for path in (args.recording, args.write_reference) if path is not None)
    return Verdict(
        passed=passed,
        line=f"{args.bundle.name} in {engine}: {outcome_line(worst)}",
        numbers=(
            f"{worst.survived_s:.1f} of {worst.duration_s:.1f} s within the rules",
            f"bodies {worst.body_error_mm:.0f} mm off the reference",
            _hardest(worst),
        ),
        notes=(*others, _rules(), *notes),
        troubles=() if passed else (_trouble(worst, args),),
        written=written,
        steps=_steps(args, passed, written),
        data={"results": {name: result.as_dict() for name, result in results.items()}},
    )


def _hardest(result: Evaluation) -> str:
    hard = result.hardest
    return f"hardest in second {hard.at_s:.0f}{f', where {hard.failed} fail' if hard.failed else ''}"


def _rules() -> str:
    from tracking import TaskConfig

    rule = TaskConfig().terminations
    return (
        f"falls: the trunk {100 * rule.anchor_height:.0f} cm off its height, or tilted; strays: a foot or a wrist "
        f"{100 * rule.end_effector_height:.0f} cm off its height, and never a fall"
    )


def _trouble(result: Evaluation, args: Arguments) -> Trouble:
    causes = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in result.causes.items() if count)
    what = f"below the gate of {100 * GATE:.0f} %: first off by {causes}" if causes else f"below {100 * GATE:.0f} %"
    cures = []
    if (args.bundle / "checkpoint.pt").exists():
        cures.append(
            ("train on", line("dance-train", "--ref", args.bundle / "reference.npz", "-o", args.bundle, "--resume"))
        )
    return Trouble(what=what, cures=tuple(cures))


def _steps(args: Arguments, passed: bool, written: tuple[Path, ...]) -> tuple[tuple[str, str], ...]:
    look = (
        (line("rerun", written[0]), "look at it")
        if args.recording is not None
        else (again({"--recording": "eval.rrd"}), "record it, to look")
    )
    if not passed:
        return (look,)
    if args.ref is not None:  # a tracker is no bundle of one dance
        return (look,)
    more = [] if args.engine == "all" else [(again({"--engine": "all"}), "the same in PhysX, twice")]
    return (look, *more, (line("dance-export", args.bundle, "-o", "bundle"), "for a robot, or another tool"))
