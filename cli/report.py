"""`dance-report`: what any tool's joint-space file is worth, as it stands."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from cli.judging import OWN_FEET, Judged, judge_all, metrics_table
from cli.shell import (
    FileOptions,
    TellOptions,
    Trouble,
    Verdict,
    command,
    line,
    recording_name,
    tell,
)
from clips.checks import check_sway


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Judge a robot's motion as it stands, without solving anything: ours, GMR's, PHC's, BeyondMimic's, mjlab's, Unitree's.

    The same report and gates as after a retargeting; its own feet say what touches. Several files come side by side.

    Examples:
        dance-report motion.npz
        dance-report unitree.csv --fps 30
        dance-report ours.npz gmr.pkl beyondmimic.npz
        dance-report gmr.pkl --recording gmr.rrd
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Motion files of a robot's joints, of any layout that is read (docs/formats.md)."""
    recording: Path | None = None
    """Write a Rerun recording here, where there is one file; several: dance-compare."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-report`."""
    return command(Arguments, run, name="dance-report", argv=argv)


def run(args: Arguments) -> int:
    """Read, judge, tell."""
    recording_name(args.recording)
    judged = judge_all(args.files, args.file)
    written: tuple[Path, ...] = ()
    if args.recording is not None:
        written = (args.recording,)
        _record(args.recording, judged)
    return tell(_verdict(judged, written, args.file), args.tell, shown=[metrics_table(judged)])


def _record(path: Path, judged: list[Judged]) -> None:
    if len(judged) == 1:
        judged[0].result.save(path)
    else:
        from retarget.recordings import save_comparison

        save_comparison(path, {j.name: (j.result.robot, j.result.reference) for j in judged})


def _verdict(judged: list[Judged], written: tuple[Path, ...], options: FileOptions) -> Verdict:
    good = [j.name for j in judged if j.result.report.passed]
    first = judged[0]
    what = f"{first.clip.source.dialect}, {first.result.reference.duration_s:.1f} s for {first.result.robot.name}"
    steps: tuple[tuple[str, str], ...] = ()
    if len(judged) == 1:
        said = f"{first.name} as it stands: {what}; {'every gate holds' if good else 'gates are missed'}"
        if good:
            steps = (
                (line("dance-train", "--ref", first.path, *options.words()), "a policy that dances it as it stands"),
            )
        else:
            steps = (
                (
                    line("dance-retarget", first.path, "--robot", first.result.robot.name, *options.words()),
                    "the same motion, solved anew",
                ),
            )
    else:
        said = f"{len(good)} of {len(judged)} inside every gate{': ' if good else ''}{', '.join(good)}"
    return Verdict(
        passed=len(good) == len(judged),
        line=said,
        notes=(OWN_FEET,),
        doubts=tuple(
            f"{j.name}: {rate}" for j, rate in ((j, check_sway(j.clip)) for j in judged) if rate.verdict == "doubtful"
        ),
        troubles=tuple(Trouble(what=f"{j.name}: {d}") for j in judged for d in j.result.diagnoses),
        written=written,
        steps=(*((line("rerun", path), "look at it") for path in written), *steps),
        data={"reports": {j.name: j.result.report.as_dict() for j in judged}},
    )
