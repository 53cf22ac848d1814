"""`dance-retarget`: a mocap file and a robot in, a reference and a recording out."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console

from cli.terminal import BELOW_GATE, DONE, ClipPath, FileOptions, Out, command, print_report, progress
from clips import OutputError, cut, read_clip, save_reference
from retarget import RetargetConfig, Retargeted, retarget
from robot_models import DEFAULT_ROBOT, load_robot


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Bring a mocap file to a robot: writes a reference (.npz) and a Rerun recording (.rrd).

    Examples:
        dance-retarget clip.csv
        dance-retarget dance.bvh --robot g1 -o dance_g1.npz --start 5 --end 25
        dance-retarget unitree.csv --fps 30 --robot g1
    """

    clip: ClipPath
    """CSV, PKL, NPZ or BVH; what it is is found out from its content."""
    robot: str = DEFAULT_ROBOT
    """A built-in robot (dancer, g1, jvrc1, ...) or the path of a profile (.toml)."""
    out: Out = None
    """The reference to write; default: <clip>_<robot>.npz in the current folder."""
    start: float = 0.0
    """Begin at this second of the clip."""
    end: float | None = None
    """End at this second of the clip."""
    out_fps: float = 50.0
    """Frame rate of the reference."""
    lead_in: float = 1.0
    """Seconds from standing into the first pose (0: none)."""
    lead_out: float = 1.0
    """Seconds from the last pose back to standing (0: none)."""
    float32: bool = False
    """Write single precision: half the size, forward kinematics to 1e-5."""
    recording: bool = True
    """Write a Rerun recording beside the reference."""
    file: FileOptions = field(default_factory=FileOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-retarget`."""
    return command(Arguments, run, name="dance-retarget", argv=argv)


def run(args: Arguments) -> int:
    """Read, retarget, save, report."""
    console = Console(highlight=False, soft_wrap=True)
    if args.out is not None and (args.out.suffix != ".npz" or args.out.resolve() == args.clip.resolve()):
        raise OutputError(f"--out {args.out}", found="that name", expected="a new file that ends in .npz")
    robot = load_robot(args.robot)
    clip = cut(read_clip(args.clip, args.file.reading()), args.start, args.end)
    console.print(f"[bold]{args.clip.name}[/]: {clip.source.dialect}, {clip.frames} frames at {clip.fps:.6g} fps")
    for finding in clip.source.findings:
        console.print(f"  {finding}", markup=False)
    config = replace(RetargetConfig(), fps=args.out_fps, lead_in_s=args.lead_in, lead_out_s=args.lead_out)
    began = time.perf_counter()
    with progress("frames") as tell:
        result = retarget(clip, robot, config, progress=tell)
    rate = result.reference.frames / (time.perf_counter() - began)
    out = args.out or Path(f"{args.clip.stem}_{robot.name}.npz")
    save_reference(result.reference, out, float32=args.float32)
    written = [out]
    if args.recording:
        from cli.show import save_retargeting

        written.append(out.with_suffix(".rrd"))
        save_retargeting(written[-1], result)
    return _summary(console, result, written, rate)


def _summary(console: Console, result: Retargeted, written: list[Path], rate: float) -> int:
    report, reference = result.report, result.reference
    print_report(report, console)
    console.print(
        f"{reference.frames} frames, {reference.duration_s:.1f} s for {result.robot.name}; retargeted at {rate:.0f} frames/s"
    )
    for path in written:
        hint = f"   open it: rerun {path}" if path.suffix == ".rrd" else ""
        console.print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB){hint}", markup=False)
    if report.passed:
        console.print("[green]all gates hold[/]")
        return DONE
    console.print(f"[red]below the gate[/]: {', '.join(m.name for m in report.failures)}")
    return BELOW_GATE
