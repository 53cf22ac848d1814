"""`dance-inspect`: what a motion file is and why, without retargeting it."""

from __future__ import annotations

from dataclasses import dataclass, field

from rich.console import Console
from rich.table import Table

from cli.terminal import DONE, Clip, FileOptions, command
from clips import HumanClip, read_clip
from clips.clip import OPTIONAL, REQUIRED


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Print what a motion file is: dialect, rate, units, axes, orders, joints, and the evidence for each.

    Examples:
        dance-inspect dance.bvh
        dance-inspect unitree.csv --fps 30
    """

    clip: Clip
    """CSV, PKL, NPZ or BVH."""
    file: FileOptions = field(default_factory=FileOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-inspect`."""
    return command(Arguments, run, name="dance-inspect", argv=argv)


def run(args: Arguments) -> int:
    """Read and describe."""
    console = Console(highlight=False)
    clip = read_clip(args.clip, args.file.reading())
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("what", "value", "how", "why", "override"):
        table.add_column(column, overflow="fold")
    table.add_row("dialect", clip.source.dialect, "measured", "content of the file", "")
    table.add_row("length", f"{clip.frames} frames", "stated", f"{(clip.frames - 1) / clip.fps:.2f} s at {clip.fps:.6g} fps", "")
    for f in clip.source.findings:
        flag = {"": "", "robot": "--source-robot"}.get(f.option, "--" + f.option.replace("_", "-"))
        table.add_row(f.what, f.value, f.confidence, f.why, flag)
    if isinstance(clip, HumanClip):
        table.add_row("height", f"{clip.height:.2f} m", "measured", "from the length of the legs", "--stature")
        missing = [k for k in OPTIONAL if k not in clip.landmarks]
        found = len([k for k in REQUIRED if k in clip.landmarks])
        why = f"{found} of {len(REQUIRED)} needed landmarks; not in the file: {', '.join(missing) or 'none'}"
        table.add_row("points", str(len(clip.names)), "measured", why, "")
    else:
        table.add_row("joints", str(len(clip.joint_names)), "measured", f"of {clip.robot}: {', '.join(clip.joint_names)}", "")
    for note in clip.source.conversions:
        table.add_row("converted", note, "", "", "")
    console.print(table)
    return DONE
