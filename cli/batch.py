"""`dance-retarget FOLDER`: every clip below it to every robot named, one table at the end."""

from __future__ import annotations

import glob
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from cli.terminal import BELOW_GATE, DONE, REFUSED, progress
from clips import ClipError, OutputError, write_whole
from retarget import RetargetConfig, RetargetError
from retarget.workflows import BatchConfig, Job, Outcome, jobs_for, motion_files, run_batch, summary_rows
from robot_models.maths import available_threads

if TYPE_CHECKING:
    from cli.retarget import Arguments

_COLUMNS = (  # of the table on the screen: metric, heading, digits
    ("deepest point under the floor", "floor mm", 1), ("deepest self-collision", "self mm", 1),
    ("limb direction error", "limbs deg", 1), ("slide per touch, worst", "slide mm", 1),
    ("frames that physics does not allow", "physics %", 0),
)  # fmt: skip
_STYLE = {"keep": "green", "down-weight": "yellow", "quarantine": "red", "exclude": "red"}


def is_batch(clip: Path) -> bool:
    """A folder, or a pattern of names that is no file itself."""
    return clip.is_dir() or (not clip.exists() and glob.has_magic(str(clip)))


def retarget_all(args: Arguments) -> int:
    """Run the batch and print its table."""
    console = Console(highlight=False, soft_wrap=True)
    _check(args)
    folder = args.out or Path("references")
    clips = (
        motion_files(args.clip, but=folder)
        if args.clip.is_dir()
        else sorted(map(Path, glob.glob(str(args.clip), recursive=True)))
    )
    if folder.resolve() == args.clip.resolve():
        raise OutputError(f"--out {folder}", found="the folder of the clips", expected="another: results are no clips")
    if not clips:
        raise ClipError(str(args.clip), found="no motion file", expected="BVH, CSV, PKL, NPZ, AMC, C3D or txt below it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise OutputError(f"--out {folder}", found=f"no folder ({e.strerror})", expected="a folder") from e
    jobs = jobs_for(clips, args.robot.split(","), folder)
    retargeting = replace(
        RetargetConfig(), solver=args.solver, fps=args.out_fps, lead_in_s=args.lead_in, lead_out_s=args.lead_out
    )
    config = BatchConfig(
        reading=args.file.reading(), retargeting=retargeting, strict=args.file.strict, float32=args.float32
    )
    outcomes: list[Outcome] = []
    with progress("clips") as tell:
        for outcome in _outcomes(jobs, config, args):
            outcomes.append(outcome)
            tell("retarget", len(outcomes), len(jobs), f"{Path(outcome.clip).name}: {outcome.verdict}")
    outcomes.sort(key=lambda o: (o.clip, o.robot))
    table = folder / "summary.csv"
    _save(table, outcomes)
    _print(console, outcomes)
    console.print(
        f"wrote {table} and {sum(o.verdict != 'exclude' for o in outcomes)} references in {folder}", markup=False
    )
    verdicts = Counter(o.verdict for o in outcomes)
    if verdicts["exclude"] == len(outcomes):
        return REFUSED
    return DONE if set(verdicts) <= {"keep", "down-weight"} else BELOW_GATE


def _outcomes(jobs: list[Job], config: BatchConfig, args: Arguments) -> Iterator[Outcome]:
    if args.ray is None:
        return run_batch(jobs, config, min(args.jobs or available_threads(), len(jobs)))
    from retarget.workflows import run_on_ray

    return run_on_ray(jobs, config, args.ray)


def _check(args: Arguments) -> None:
    """Refuse what means one clip."""
    if args.ray is not None and args.jobs is not None:
        raise RetargetError(
            "--jobs", found="--ray beside it", expected="one of them", cure="the cluster knows its cores"
        )
    given = [
        name
        for name, value in {
            "--start": args.start, "--end": args.end, "--speed": args.speed != 1.0, "--mirror": args.mirror,
            "--then": args.then, "--loop": args.loop != 1, "--contacts": args.contacts, "--keys": args.keys,
            "--write-contacts": args.write_contacts, "--fit-dynamics": args.fit_dynamics,
        }.items()
        if value
    ]  # fmt: skip
    if given:
        raise RetargetError(
            ", ".join(given), found="a folder of clips beside it", expected="one clip",
            cure="retarget that clip by itself",
        )  # fmt: skip


def _save(path: Path, outcomes: list[Outcome]) -> None:
    import pandas as pd

    with write_whole(path) as stream:
        pd.DataFrame(summary_rows(outcomes)).to_csv(stream, index=False)


def _print(console: Console, outcomes: list[Outcome]) -> None:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("verdict", "clip", "robot", "s", *(heading for _, heading, _ in _COLUMNS), ""):
        left = column in ("verdict", "clip", "robot", "")
        table.add_column(column, justify="left" if left else "right", no_wrap=True)
    for o in outcomes:
        numbers = [f"{o.metrics[m]:.{d}f}" if m in o.metrics else "" for m, _, d in _COLUMNS]
        verdict, was_there = f"[{_STYLE[o.verdict]}]{o.verdict}[/]", "was there" if o.skipped else ""
        table.add_row(verdict, Path(o.clip).name, Path(o.robot).stem, f"{o.seconds:.1f}", *numbers, was_there)
    (console if console.is_terminal else Console(width=200, highlight=False)).print(table)
    for o in outcomes:
        why = f"below the gate: {', '.join(o.failed)}" if o.failed else o.message
        if o.verdict == "down-weight" and o.hardest:
            why = f"hardest: {o.hardest[0]}"
        if why:
            console.print(f"{o.verdict}: {Path(o.clip).name} on {Path(o.robot).stem}: {why}", markup=False)
