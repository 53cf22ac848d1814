"""What was recognised in a recording and why, and what it was asked."""

from __future__ import annotations

from rich.table import Table

from cli.shell import flag
from clips import OPTIONAL, REQUIRED, Clip, HumanClip
from clips.checks import CHECKS

_STYLES = {"holds": "", "doubtful": "yellow", "refused": "red", "cannot tell": "dim"}


def evidence(clip: Clip, no_rate: bool) -> list[str]:
    """What was recognised, a line for what and one for why."""

    def line(what: str, value: str, why: str, option: str = "") -> str:
        override = f"   [{flag(option)}]" if option else ""
        return f"{what:<18} {value}\n{'':<18}   {why}{override}"

    lines = [line("dialect", clip.source.dialect, f"sha256 {clip.source.sha256[:16]}")]
    if no_rate:
        lines.append(line("length", f"{clip.frames} frames", "the file does not say its rate", "fps"))
    else:
        length = f"{clip.frames} frames, {(clip.frames - 1) / clip.fps:.2f} s"
        lines.append(line("length", length, f"at {clip.fps:.6g} per second"))
    told = [f for f in clip.source.findings if not (no_rate and f.what == "fps")]
    lines += [line(f.what, f.value, f"{f.confidence}: {f.why}", f.option) for f in told]
    if isinstance(clip, HumanClip):
        lines.append(line("height", f"{clip.height:.2f} m", "measured: legs over 0.491 (Drillis & Contini)", "stature"))
        missing = [k for k in OPTIONAL if k not in clip.landmarks]
        found = len([k for k in REQUIRED if k in clip.landmarks])
        why = f"{found} of {len(REQUIRED)} needed landmarks; optional ones missing: {', '.join(missing) or 'none'}"
        lines.append(line("points", str(len(clip.names)), why))
        lines.append(
            line("landmarks", f"{len(clip.landmarks)}", ", ".join(f"{k} = {v}" for k, v in clip.landmarks.items()))
        )
    else:
        lines.append(line("joints", f"{len(clip.joint_names)} of {clip.robot}", ", ".join(clip.joint_names)))
    lines += [line("converted", note, "") for note in clip.source.conversions]
    return lines + [line("repaired", str(mended), "--strict refuses it") for mended in clip.source.repairs]


def checks_table(clip: Clip) -> Table:
    """What the recording was asked: whether it is a person moving, or a robot."""
    table = Table(
        "check", "measured", "a person shows", "verdict", "where", box=None, pad_edge=False, header_style="bold"
    )
    for question in CHECKS:
        check = question(clip)
        cells = (check.what, check.value, check.limit, check.verdict, check.where)
        table.add_row(*cells, style=_STYLES[check.verdict])
    return table
