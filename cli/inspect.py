"""`dance-inspect`: what a motion file is and why, without retargeting it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from rich.console import Console
from rich.table import Table

from cli.shell import DONE, ClipPath, FileOptions, command, flag, make_console
from clips import OPTIONAL, REQUIRED, Clip, ClipError, HumanClip, read_clip, repair
from clips.checks import CHECKS

_STYLES = {"holds": "", "doubtful": "yellow", "refused": "red", "cannot tell": "dim"}
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


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-inspect`."""
    return command(Arguments, run, name="dance-inspect", argv=argv)


def run(args: Arguments) -> int:
    """Read and describe."""
    console = make_console()
    clip, no_rate = _read(args)
    clip, trouble = (clip, "") if no_rate else _mended(clip, args.file.strict)

    def tell(what: str, value: str, why: str, option: str = "") -> None:
        override = f"   [{flag(option)}]" if option else ""
        console.print(f"{what:<18} {value}\n{'':<18}   {why}{override}")

    tell("dialect", clip.source.dialect, f"sha256 {clip.source.sha256[:16]}")
    if no_rate:
        tell("length", f"{clip.frames} frames", "the file does not say its rate", "fps")
    else:
        tell("length", f"{clip.frames} frames, {(clip.frames - 1) / clip.fps:.2f} s", f"at {clip.fps:.6g} per second")
    for f in clip.source.findings:
        if no_rate and f.what == "fps":
            continue
        tell(f.what, f.value, f"{f.confidence}: {f.why}", f.option)
    if isinstance(clip, HumanClip):
        tell("height", f"{clip.height:.2f} m", "measured: legs over 0.491 (Drillis & Contini)", "stature")
        missing = [k for k in OPTIONAL if k not in clip.landmarks]
        found = len([k for k in REQUIRED if k in clip.landmarks])
        why = f"{found} of {len(REQUIRED)} needed landmarks; optional ones missing: {', '.join(missing) or 'none'}"
        tell("points", str(len(clip.names)), why)
        tell("landmarks", f"{len(clip.landmarks)}", ", ".join(f"{k} = {v}" for k, v in clip.landmarks.items()))
    else:
        tell("joints", f"{len(clip.joint_names)} of {clip.robot}", ", ".join(clip.joint_names))
    for note in clip.source.conversions:
        tell("converted", note, "")
    for mended in clip.source.repairs:
        tell("repaired", str(mended), "--strict refuses it")
    if not no_rate:
        _print_checks(console, clip)
    if trouble:
        tell("cannot be used", trouble, "")
    return DONE


def _print_checks(console: Console, clip: Clip) -> None:
    """What the recording was asked: whether it is a person moving, or a robot."""
    table = Table(
        "check", "measured", "a person shows", "verdict", "where", box=None, pad_edge=False, header_style="bold"
    )
    for question in CHECKS:
        check = question(clip)
        cells = (check.what, check.value, check.limit, check.verdict, check.where)
        table.add_row(*cells, style=_STYLES[check.verdict])
    console.print(table)


def _mended(clip: Clip, strict: bool) -> tuple[Clip, str]:
    """The clip as retargeting would take it, and why it would not."""
    try:
        return repair(clip, strict=strict), ""
    except ClipError as e:
        return clip, str(e)


def _read(args: Arguments) -> tuple[Clip, bool]:
    """The clip, and whether its rate had to be left open: what a file is can be told without it."""
    options = args.file.reading()
    try:
        return read_clip(args.clip, options), False
    except ClipError as e:
        if e.option != "fps" or options.fps is not None:
            raise
    return read_clip(args.clip, replace(options, fps=_ANY_RATE)), True
