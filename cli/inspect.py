"""`dance-inspect`: what a motion file is and why, without retargeting it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from cli.inspecting import checks_table, evidence
from cli.shell import ClipPath, FileOptions, TellOptions, Trouble, Verdict, again, command, line, tell
from clips import Clip, ClipError, HumanClip, is_reference, read_clip, repair
from clips.checks import CHECKS

_ANY_RATE = 1.0  # stands in while a file without a rate is described; no number that depends on it is printed


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Print what a motion file is: dialect, rate, units, axes, orders, joints, and the evidence for each.

    Examples:
        dance-inspect dance.bvh
        dance-inspect unitree.csv --fps 30
    """

    clip: ClipPath
    """A motion file of any layout that is read (docs/formats.md)."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-inspect`."""
    return command(Arguments, run, name="dance-inspect", argv=argv)


def run(args: Arguments) -> int:
    """Read and describe."""
    clip, no_rate, rate = _read(args)
    clip, trouble = (clip, "") if no_rate else _mended(clip, args.file.strict)
    verdict = _verdict(args, clip, no_rate, rate, trouble)
    table = [] if no_rate else [checks_table(clip)]
    return tell(verdict, args.tell, shown=[*evidence(clip, no_rate), *table])


def _verdict(args: Arguments, clip: Clip, no_rate: bool, rate: str, trouble: str) -> Verdict:
    """Whether it can be used, as it is; `rate` is the one that fits a file without any."""
    whose = f"{clip.robot}'s joints" if not isinstance(clip, HumanClip) else "a person"
    length = f"{clip.frames} frames" if no_rate else f"{(clip.frames - 1) / clip.fps:.1f} s at {clip.fps:.6g} fps"
    known = f"{clip.source.file}: {clip.source.dialect}, {whose}, {length}"
    doubtful = (
        []
        if no_rate
        else [f"{c.what}: {c.value}" for c in (check(clip) for check in CHECKS) if c.verdict == "doubtful"]
    )
    troubles = [Trouble(what=f"cannot be used: {trouble}")] if trouble else []
    if no_rate:
        cures = (("state it; the body sways as gravity has it at", again({"--fps": rate})),) if rate else ()
        troubles.append(Trouble(what="the file does not say its rate; --fps states it", cures=cures))
    return Verdict(
        passed=not troubles,
        line=known,
        doubts=tuple(doubtful),
        troubles=tuple(troubles),
        steps=() if troubles else _next(args.clip, args.file.words()),
        data={"source": asdict(clip.source), "frames": clip.frames, "fps": None if no_rate else clip.fps},
    )


def _next(file: Path, stated: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """What a clip is brought to, and what a reference is good for."""
    if is_reference(file):
        return (
            (line("dance-play", file), "watch it"),
            (line("dance-train", "--ref", file), "a policy that dances it"),
        )
    return ((line("dance-retarget", file, *stated), "bring it to a robot; --robot g1"),)


def _mended(clip: Clip, strict: bool) -> tuple[Clip, str]:
    """The clip as retargeting would take it, and why it would not."""
    try:
        return repair(clip, strict=strict), ""
    except ClipError as e:
        return clip, str(e)


def _read(args: Arguments) -> tuple[Clip, bool, str]:
    """The clip, whether its rate had to be left open (what a file is can be told without it), and the rate that fits."""
    options = args.file.reading()
    try:
        return read_clip(args.clip, options), False, ""
    except ClipError as e:
        if e.option != "fps" or options.fps is not None:
            raise
        rate = e.suggestion
    return read_clip(args.clip, replace(options, fps=_ANY_RATE)), True, rate
