"""`dance-retarget FOLDER`: every clip below it to every robot named, one table at the end."""

from __future__ import annotations

import glob
from collections.abc import Iterator
from pathlib import Path

from cli.retargeting.arguments import Arguments
from cli.retargeting.batch_verdict import batch_verdict, outcome_lines, outcome_table
from cli.shell import again, interrupted_by_signals, progress, tell
from clips import ClipError, OutputError, ReadOptions, clips_in, file_and_name, write_whole
from retarget import RetargetError
from retarget.workflows import BatchConfig, Job, Outcome, jobs_for, motion_files, run_batch, summary_rows
from robot_models.maths import available_threads


def is_batch(args: Arguments) -> bool:
    """Whether more is asked for than one clip on one robot: folders, patterns of names, several of either."""
    several = len(args.clips) > 1 or "," in args.robot
    return several or args.clip.is_dir() or (not args.clip.exists() and glob.has_magic(str(args.clip)))


def retarget_all(args: Arguments) -> int:
    """Run the batch and print its table."""
    _check(args)
    absent = [c for c in args.clips if not file_and_name(c)[0].exists() and not glob.has_magic(str(c))]
    if absent:
        cure = "a name with spaces wants quotes" if len(args.clips) > 1 else ""
        raise ClipError(" ".join(map(str, absent)), found="no such file", expected="files and folders", cure=cure)
    folder = args.out or Path("references")
    if folder.resolve() in [clip.resolve() for clip in args.clips]:
        raise OutputError(f"--out {folder}", found="the folder of the clips", expected="another: results are no clips")
    clips = list(dict.fromkeys(clip for named in args.clips for clip in _files(named, folder, args.file.reading())))
    if not clips:
        named = " ".join(map(str, args.clips))
        raise ClipError(named, found="no motion file", expected="BVH, CSV, PKL, NPZ, AMC, C3D or txt below it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise OutputError(f"--out {folder}", found=f"no folder ({e.strerror})", expected="a folder") from e
    jobs = jobs_for(clips, args.robot.split(","), folder)
    config = BatchConfig(
        reading=args.file.reading(), retargeting=args.numbers(), strict=args.file.strict, float32=args.float32
    )
    outcomes: list[Outcome] = []
    table = folder / "summary.csv"
    try:
        with interrupted_by_signals(), progress("clips") as follow:
            for outcome in _outcomes(jobs, config, args):
                outcomes.append(outcome)
                follow("retarget", len(outcomes), len(jobs), f"{Path(outcome.clip).name}: {outcome.verdict}")
    finally:  # also of a batch that is stopped: what was done is told, and found again
        outcomes.sort(key=lambda o: (o.clip, o.robot))
        _save(table, outcomes)
    return tell(
        batch_verdict(outcomes, table, args.file.words()), args.tell, outcome_lines(outcomes), [outcome_table(outcomes)]
    )


def _files(named: Path, folder: Path, options: ReadOptions) -> list[Path]:
    """The clips that a name on the command line stands for; results of earlier batches in `folder` are none."""
    file, sign, rest = str(named).partition("#*")
    if sign and not rest and Path(file).is_file():
        return clips_in(Path(file), options)
    if named.is_dir():
        return motion_files(named, but=folder)
    if not named.exists() and glob.has_magic(str(named)):
        return sorted(map(Path, glob.glob(str(named), recursive=True)))
    return [named]


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
            "--then": args.then, "--drop": args.drop, "--loop": args.loop != 1, "--contacts": args.contacts, "--keys": args.keys,
            "--write-contacts": args.write_contacts, "--fit-dynamics": args.fit_dynamics,
            "--arms, --legs or --keep": args.arms or args.legs or args.keep,
            "--music, --bpm or --beats": args.song.given, "--film": args.film,
        }.items()
        if value
    ]  # fmt: skip
    if given:
        raise RetargetError(
            ", ".join(given), found="several clips or robots beside it", expected="one clip, one robot", cure=_alone(args),
        )  # fmt: skip


def _alone(args: Arguments) -> str:
    """What to type instead."""
    if len(args.clips) == 1 and args.clip.is_file():
        return f"one robot after the other: {again({'--robot': args.robot.split(',')[0]})}"
    return "retarget that clip by itself"
