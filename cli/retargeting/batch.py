"""`dance-retarget FOLDER`: every clip below it to every robot named, one table at the end."""

from __future__ import annotations

import glob
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from cli.retargeting.arguments import Arguments
from cli.retargeting.batch_table import print_outcomes
from cli.shell import BELOW_GATE, DONE, REFUSED, interrupted_by_signals, make_console, progress
from clips import ClipError, OutputError, write_whole
from retarget import RetargetError
from retarget.workflows import BatchConfig, Job, Outcome, jobs_for, motion_files, run_batch, summary_rows
from robot_models.maths import available_threads


def is_batch(clip: Path) -> bool:
    """A folder, or a pattern of names that is no file itself."""
    return clip.is_dir() or (not clip.exists() and glob.has_magic(str(clip)))


def retarget_all(args: Arguments) -> int:
    """Run the batch and print its table."""
    console = make_console()
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
    config = BatchConfig(
        reading=args.file.reading(), retargeting=args.config(), strict=args.file.strict, float32=args.float32
    )
    outcomes: list[Outcome] = []
    table = folder / "summary.csv"
    try:
        with interrupted_by_signals(), progress("clips") as tell:
            for outcome in _outcomes(jobs, config, args):
                outcomes.append(outcome)
                tell("retarget", len(outcomes), len(jobs), f"{Path(outcome.clip).name}: {outcome.verdict}")
    finally:  # also of a batch that is stopped: what was done is told, and found again
        outcomes.sort(key=lambda o: (o.clip, o.robot))
        _save(table, outcomes)
    print_outcomes(console, outcomes)
    console.print(f"wrote {table} and {sum(o.verdict != 'exclude' for o in outcomes)} references in {folder}")
    verdicts = Counter(o.verdict for o in outcomes)
    if verdicts["exclude"] == len(outcomes):
        return REFUSED
    return DONE if set(verdicts) <= {"keep", "down-weight"} else BELOW_GATE


def _outcomes(jobs: list[Job], config: BatchConfig, args: Arguments) -> Iterator[Outcome]:
    if args.ray is None:
        return run_batch(jobs, config, min(args.jobs or available_threads(), len(jobs)))
    from retarget.workflows import run_on_ray

    return run_on_ray(jobs, config, args.ray)


def _save(path: Path, outcomes: list[Outcome]) -> None:
    import pandas as pd

    with write_whole(path) as stream:
        pd.DataFrame(summary_rows(outcomes)).to_csv(stream, index=False, errors="backslashreplace")


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
