"""`dance-compare`: motions side by side: metrics, limb angles, contacts, and a recording of both."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from cli.judging import OWN_FEET, difference_table, judge_all, metrics_table
from cli.shell import (
    DONE,
    FileOptions,
    TellOptions,
    Verdict,
    command,
    line,
    recording_name,
    tell,
)
from clips import ClipError
from retarget import limb_angles


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Put two or more motions of robots side by side, each as it stands; of two, how far their limbs are apart.

    Examples:
        dance-compare ours.npz gmr.pkl
        dance-compare before.npz after.npz --recording both.rrd
        dance-compare ours.npz gmr.pkl unitree.csv --fps 30 --recording three.rrd
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Motion files of robots' joints, of any layout that is read; the first is what the others are held against."""
    recording: Path | None = None
    """Write a Rerun recording here: all side by side, with the lanes of their contacts."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-compare`."""
    return command(Arguments, run, name="dance-compare", argv=argv)


def run(args: Arguments) -> int:
    """Read, judge, compare, tell."""
    if len(args.files) == 1:
        raise ClipError(str(args.files[0]), found="one file", expected="two at least", cure="one alone: dance-report")
    recording_name(args.recording)
    judged = judge_all(args.files, args.file)
    first, *others = judged
    one = first.result
    apart = {j.name: limb_angles(one.reference, one.robot, j.result.reference, j.result.robot) for j in others}
    means = {name: sum(float(a.mean()) for a in limbs.values()) / len(limbs) for name, limbs in apart.items()}
    written: tuple[Path, ...] = ()
    if args.recording is not None:
        from retarget.recordings import save_comparison

        save_comparison(args.recording, {j.name: (j.result.robot, j.result.reference) for j in judged})
        written = (args.recording,)
    verdict = Verdict(
        passed=True,
        code=DONE,  # the question, how far apart they are, is answered
        line="; ".join(f"limbs of {name} {mean:.1f} deg off those of {first.name}" for name, mean in means.items()),
        notes=(
            *(
                f"{j.name}: {j.clip.source.dialect}, {j.result.reference.duration_s:.1f} s for {j.result.robot.name}"
                for j in judged
            ),
            OWN_FEET,
        ),
        doubts=tuple(
            f"{j.name} misses gates: {', '.join(m.label for m in j.result.report.failures)}"
            for j in judged
            if not j.result.report.passed
        ),
        written=written,
        steps=tuple((line("rerun", path), "look at them") for path in written),
        data={"limb_angles_deg": means, "reports": {j.name: j.result.report.as_dict() for j in judged}},
    )
    differences = [difference_table(first, j) for j in others]
    return tell(verdict, args.tell, shown=[metrics_table(judged), *differences])
