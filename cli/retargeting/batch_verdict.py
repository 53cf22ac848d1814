"""What became of every clip of a batch, as a table for the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.table import Table
from rich.text import Text

from cli.shell import BELOW_GATE, DONE, REFUSED, SOME_REFUSED, Trouble, Verdict, line
from clips import MetricKey, clip_stem
from retarget.workflows import Outcome

_COLUMNS = (  # of the table on the screen: metric, heading, digits
    (MetricKey.PENETRATION, "floor mm", 1), (MetricKey.SELF_COLLISION, "self mm", 1),
    (MetricKey.LIMB_DIRECTION_ERROR, "limbs deg", 1), (MetricKey.SLIDE_WORST, "slide mm", 1),
    (MetricKey.IMPOSSIBLE_FRAMES, "impossible %", 0),
)  # fmt: skip
_NAMED = 4  # jobs that are named of each trouble
_WORDS = {
    "down-weight": "down-weight: inside its gates, but physics does not allow a tenth of its frames or more",
    "quarantine": "quarantine: below a gate; written all the same",
    "exclude": "exclude: refused; nothing written",
}
_HELP = "by itself it says what helps, and the batch keeps it"
_STYLE = {"keep": "green", "down-weight": "yellow", "quarantine": "red", "exclude": "red"}


def batch_verdict(outcomes: Sequence[Outcome], table: Path, stated: Sequence[str] = ()) -> Verdict:
    """How many clips came to what, the commonest trouble first; `stated` of the files, as it was typed.

    Exit code: 0 every reference inside its gates; 1 some below one; 2 nothing but refusals; 3 refusals beside good ones.
    """
    counts = Counter(str(o.verdict) for o in outcomes)
    robots = list(dict.fromkeys(o.robot for o in outcomes))
    refused, below = counts["exclude"], counts["quarantine"]
    folder = table.parent
    said = ", ".join(f"{counts[v]} {v}" for v in _STYLE if counts[v])
    code = (
        DONE if not refused + below else REFUSED if refused == len(outcomes) else BELOW_GATE if below else SOME_REFUSED
    )
    which = ("--robot", robots[0]) if len(robots) > 1 else ()
    good = len(outcomes) - refused - below
    return Verdict(
        passed=code == DONE,
        code=code,
        line=f"{len(outcomes)} references asked for: {said or 'none'}",
        doubts=tuple(dict.fromkeys(f"{Path(o.clip).name}: {doubt}" for o in outcomes for doubt in o.doubts)),
        troubles=_troubles(outcomes, stated, folder),
        written=(table,),
        notes=(
            f"{len(outcomes) - refused} references in {folder}",
            *(_WORDS[v] for v in _STYLE if counts[v] and v in _WORDS),
        ),
        steps=(
            (
                line("dance-train", "--ref", folder, "-o", f"runs/{folder.name}", *which),
                "one policy for all of one robot",
            ),
        )
        if good
        else (),
        data={"outcomes": [asdict(o) for o in outcomes]},
    )


def _troubles(outcomes: Sequence[Outcome], stated: Sequence[str], folder: Path) -> tuple[Trouble, ...]:
    """What went wrong, the commonest first, where, and the commands that say what helps each."""
    where: dict[str, list[Outcome]] = {}
    for o in outcomes:
        for what in o.failed or ((f"refused: {o.message}",) if o.verdict == "exclude" else ()):
            where.setdefault(what.replace(f"{o.clip}: ", "").replace(f"{Path(o.clip).name}: ", ""), []).append(o)
    ranked = sorted(where.items(), key=lambda pair: -len(pair[1]))
    told, troubles = set[str](), []
    for what, of in ranked:
        names = [_name(o) for o in of]
        fresh = [o for o in of[:_NAMED] if _output(o, folder) not in told]
        told |= {_output(o, folder) for o in fresh}
        troubles.append(
            Trouble(
                what=f"{len(names)} x {what}: {', '.join(names[:_NAMED])}{', ...' if len(names) > _NAMED else ''}",
                cures=tuple(_cure(o, stated, folder) for o in fresh),
            )
        )
    return tuple(troubles)


def _cure(o: Outcome, stated: Sequence[str], folder: Path) -> tuple[str, str]:
    """What to do about a reference, or about a clip that was refused."""
    if o.reference:
        return _HELP, _alone(o, stated, folder)
    return f"brought to the robot by itself as {_output(o, folder)}, the batch keeps it", ""


def _alone(o: Outcome, stated: Sequence[str], folder: Path) -> str:
    """The command that makes one reference anew; a batch leaves it as it then is."""
    return line("dance-retarget", o.clip, "--robot", o.robot, *stated, "-o", _output(o, folder))


def _output(o: Outcome, folder: Path) -> str:
    return o.reference or str(folder / f"{clip_stem(Path(o.clip))}_{Path(o.robot).stem}.npz")


def _name(o: Outcome) -> str:
    return f"{Path(o.clip).name} on {Path(o.robot).stem}"


def outcome_table(outcomes: Sequence[Outcome]) -> Table:
    """A row per job."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("verdict", "clip", "robot", "s", *(heading for _, heading, _ in _COLUMNS), ""):
        left = column in ("verdict", "clip", "robot", "")
        table.add_column(column, justify="left" if left else "right", no_wrap=True)
    for o in outcomes:
        numbers = [f"{o.metrics[m]:.{d}f}" if m in o.metrics else "" for m, _, d in _COLUMNS]
        verdict, was_there = Text(o.verdict, style=_STYLE[o.verdict]), "was there" if o.skipped else ""
        table.add_row(verdict, Path(o.clip).name, Path(o.robot).stem, f"{o.seconds:.1f}", *numbers, was_there)
    return table


def outcome_lines(outcomes: Sequence[Outcome]) -> list[str]:
    """Why each is no better."""
    lines = []
    for o in outcomes:
        why = "; ".join(o.why) or o.message
        if o.verdict == "down-weight" and o.hardest:
            why = f"hardest: {o.hardest[0]}"
        if why:
            lines.append(f"{o.verdict}: {_name(o)}: {why}")
    return lines
