"""`dance-retarget`: a mocap file and a robot in, a reference and a recording out."""

from __future__ import annotations

import time
from pathlib import Path

from rich.console import Console

from cli.batch import is_batch, retarget_all
from cli.console import console as make_console
from cli.progress import progress
from cli.report_table import print_report
from cli.retarget_arguments import Arguments, check_one
from cli.terminal import BELOW_GATE, DONE, command
from clips import Clip, at_speed, cut, read_clip, repair, save_reference
from clips.checks import doubts
from retarget import (
    Retargeted,
    Transition,
    fit_to_dynamics,
    flight_fit,
    hardest_stretches,
    read_contacts,
    read_keys,
    retarget,
    retarget_sequence,
    write_contacts,
)
from retarget.targets import mirrored
from robot_models import load_robot

_OFF_FLIGHT = 0.03  # of a flight's rise from gravity's that is worth a line [m]


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-retarget`."""
    return command(Arguments, run, name="dance-retarget", argv=argv)


def run(args: Arguments) -> int:
    """Read, retarget, save, report."""
    if is_batch(args.clip):
        return retarget_all(args)
    console = make_console()
    check_one(args)
    robot = load_robot(args.robot)
    clip = _read(args.clip, args, args.start, args.end)
    contacts = read_contacts(args.contacts) if args.contacts else ()
    keys = read_keys(args.keys) if args.keys else ()
    more = [_read(path, args) for path in args.then]
    for path, part in zip((args.clip, *args.then), (clip, *more), strict=True):
        _tell_conventions(console, path, part)
    dances = [clip, *more] * args.loop
    transitions: list[Transition] = []
    config = args.config()
    began = time.perf_counter()
    with progress("steps") as tell:
        if len(dances) > 1:
            result, transitions = retarget_sequence(dances, robot, config, progress=tell)
        elif args.fit_dynamics:
            result = fit_to_dynamics(clip, robot, config, progress=tell)
        else:
            result = retarget(clip, robot, config, contacts=contacts, keys=keys, progress=tell)
    rate = result.reference.frames / (time.perf_counter() - began)
    names = dict.fromkeys(path.stem for path in (args.clip, *args.then))
    out = args.out or Path(f"{'_'.join(names)}_{robot.name}.npz")
    save_reference(result.reference, out, float32=args.float32)
    written = [out]
    if args.write_contacts:
        write_contacts(result.contacts, result.reference.fps, args.write_contacts)
        written.append(args.write_contacts)
    if args.recording:
        from cli.recordings import save_retargeting

        written.append(out.with_suffix(".rrd"))
        save_retargeting(written[-1], result)
    for transition in transitions:
        console.print(str(transition))
    return _summary(console, result, written, rate)


def _tell_conventions(console: Console, path: Path, clip: Clip) -> None:
    console.print(f"{path.name}: {clip.source.dialect}, {clip.frames} frames at {clip.fps:.6g} fps", style="bold")
    for finding in clip.source.findings:
        console.print(f"  {finding}")
    for mended in clip.source.repairs:
        console.print(f"  repaired: {mended}")
    for doubt in doubts(clip):
        console.print(f"  doubtful: {doubt}", style="yellow")


def _read(path: Path, args: Arguments, start: float = 0.0, end: float | None = None) -> Clip:
    clip = repair(cut(read_clip(path, args.file.reading()), start, end), strict=args.file.strict)
    clip = at_speed(clip, args.speed)
    return mirrored(clip) if args.mirror else clip


def _summary(console: Console, result: Retargeted, written: list[Path], rate: float) -> int:
    report, reference = result.report, result.reference
    print_report(report, console)
    console.print(
        f"{reference.frames} frames, {reference.duration_s:.1f} s for {result.robot.name}; retargeted at {rate:.0f} frames/s"
    )
    for stretch in [] if result.dynamics is None else hardest_stretches(result.dynamics, above=1.0, most=3):
        console.print(f"physics: {stretch}")
    for flight in [] if result.dynamics is None else flight_fit(result.dynamics):
        if abs(flight.rise - flight.ballistic_rise) > _OFF_FLIGHT:
            console.print(
                f"flight from {flight.start_s:.2f} to {flight.end_s:.2f} s rises {100 * flight.rise:.0f} cm; "
                f"gravity asks for {100 * flight.ballistic_rise:.0f} cm in that time"
            )
    for path in written:
        hint = f"   open it: rerun {path}" if path.suffix == ".rrd" else ""
        console.print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB){hint}")
    if report.passed:
        console.print("all gates hold", style="green")
        return DONE
    console.print(f"below the gate: {', '.join(m.label for m in report.failures)}", style="red")
    return BELOW_GATE
