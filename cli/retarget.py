"""`dance-retarget`: a mocap file and a robot in, a reference and a recording out."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from rich.console import Console

from cli.batch import is_batch, retarget_all
from cli.terminal import BELOW_GATE, DONE, ClipPath, FileOptions, Out, command, print_report, progress
from clips import Clip, OutputError, RobotClip, at_speed, cut, mirrored, read_clip, repaired, save_reference
from retarget import (
    RetargetConfig,
    Retargeted,
    RetargetError,
    Seam,
    fitted,
    flight_fit,
    hardest,
    medley,
    read_contacts,
    read_keys,
    retarget,
    write_contacts,
)
from retarget.targets import as_figure
from robot_models import DEFAULT_ROBOT, load_robot

_OFF_FLIGHT = 0.03  # of a flight's rise from gravity's that is worth a line [m]


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Bring a mocap file to a robot: writes a reference (.npz) and a Rerun recording (.rrd).

    Examples:
        dance-retarget clip.csv
        dance-retarget dance.bvh --robot g1 -o dance_g1.npz --start 5 --end 25
        dance-retarget unitree.csv --fps 30 --robot g1
        dance-retarget verse.bvh --then chorus.bvh verse.bvh -o song.npz
        dance-retarget fast.bvh --fit-dynamics
        dance-retarget clips/ -o references --robot g1,dancer --jobs 2
        dance-retarget /shared/clips -o /shared/references --ray 10.0.0.5:6379
    """

    clip: ClipPath
    """A motion file, which is known by its content; or a folder of them, or a pattern like 'mocap/*.bvh'."""
    robot: str = DEFAULT_ROBOT
    """A built-in robot (dancer, g1, jvrc1, ...) or the path of a profile (.toml); for a folder, several with commas."""
    out: Out = None
    """The reference to write; default: <clip>_<robot>.npz in the current folder. For a folder of clips: a folder."""
    jobs: int | None = None
    """Processes for a folder of clips; default: one per core that may be used."""
    ray: str | None = None
    """Work on a Ray cluster instead: its host:port, 'auto' for this machine's, 'local' to start one here."""
    start: float = 0.0
    """Begin at this second of the clip."""
    end: float | None = None
    """End at this second of the clip."""
    speed: float = 1.0
    """Play the clip so many times as fast."""
    mirror: bool = False
    """Exchange left and right."""
    then: tuple[ClipPath, ...] = ()
    """More clips to dance after this one, with steps between them."""
    loop: int = 1
    """Dance it so many times, with steps back to the first pose between."""
    contacts: Path | None = None
    """CSV of touches (start, end, edge, kind; seconds of the dance) that override the detected ones."""
    keys: Path | None = None
    """CSV of key frames (time, joint, value; seconds of the dance, radians)."""
    write_contacts: Path | None = None
    """Write the touches used, to be edited and given back with --contacts."""
    fit_dynamics: bool = False
    """Slow the stretches that physics does not allow, and only those."""
    solver: Literal["whole-clip", "mink", "placo"] = "whole-clip"
    """All frames at once, or a per-frame solver for comparison."""
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
    if is_batch(args.clip):
        return retarget_all(args)
    console = Console(highlight=False, soft_wrap=True)
    if args.out is not None and (args.out.suffix != ".npz" or args.out.resolve() == args.clip.resolve()):
        raise OutputError(f"--out {args.out}", found="that name", expected="a new file that ends in .npz")
    _check(args)
    robot = load_robot(args.robot)
    clip = _read(args.clip, args, args.start, args.end)
    contacts = read_contacts(args.contacts) if args.contacts else ()
    keys = read_keys(args.keys) if args.keys else ()
    console.print(f"[bold]{args.clip.name}[/]: {clip.source.dialect}, {clip.frames} frames at {clip.fps:.6g} fps")
    for finding in clip.source.findings:
        console.print(f"  {finding}", markup=False)
    for repair in clip.source.repairs:
        console.print(f"  repaired: {repair}", markup=False)
    more = [_read(path, args) for path in args.then]
    dances = [clip, *more] * args.loop
    seams: list[Seam] = []
    config = replace(
        RetargetConfig(), solver=args.solver, fps=args.out_fps, lead_in_s=args.lead_in, lead_out_s=args.lead_out
    )
    began = time.perf_counter()
    with progress("steps") as tell:
        if len(dances) > 1:
            result, seams = medley(dances, robot, config, progress=tell)
        elif args.fit_dynamics:
            result = fitted(clip, robot, config, progress=tell)
        else:
            result = retarget(clip, robot, config, contacts=contacts, keys=keys, progress=tell)
    rate = result.reference.frames / (time.perf_counter() - began)
    out = args.out or Path(f"{args.clip.stem}_{robot.name}.npz")
    save_reference(result.reference, out, float32=args.float32)
    written = [out]
    if args.write_contacts:
        write_contacts(result.contacts, result.reference.fps, args.write_contacts)
        written.append(args.write_contacts)
    if args.recording:
        from cli.recordings import save_retargeting

        written.append(out.with_suffix(".rrd"))
        save_retargeting(written[-1], result)
    for seam in seams:
        console.print(f"{seam}", markup=False)
    return _summary(console, result, written, rate)


def _check(args: Arguments) -> None:
    """Refuse what cannot go together."""
    edits = args.contacts or args.keys or args.write_contacts
    if args.fit_dynamics and edits:
        raise RetargetError(
            "--fit-dynamics", found="--contacts, --keys or --write-contacts beside it",
            expected="one of them: their seconds would move when the dance is slowed",
        )  # fmt: skip
    if args.ray is not None or args.jobs is not None:
        raise RetargetError(
            "--ray or --jobs", found="one clip", expected="a folder of clips, or a pattern of names",
            cure="leave them out: one clip is one job",
        )  # fmt: skip
    several = bool(args.then) or args.loop != 1
    if several and (edits or args.fit_dynamics or args.loop < 1):
        raise RetargetError(
            "--then or --loop", found="--contacts, --keys, --write-contacts, --fit-dynamics, or a loop of less than once",
            expected="dances without edits of their own, at least once",
            cure="write each dance to a file first; a reference (.npz) is a clip again",
        )  # fmt: skip


def _read(path: Path, args: Arguments, start: float = 0.0, end: float | None = None) -> Clip:
    clip = repaired(cut(read_clip(path, args.file.reading()), start, end), strict=args.file.strict)
    clip = at_speed(clip, args.speed)
    if not args.mirror:
        return clip
    return mirrored(as_figure(clip) if isinstance(clip, RobotClip) else clip)


def _summary(console: Console, result: Retargeted, written: list[Path], rate: float) -> int:
    report, reference = result.report, result.reference
    print_report(report, console)
    console.print(
        f"{reference.frames} frames, {reference.duration_s:.1f} s for {result.robot.name}; retargeted at {rate:.0f} frames/s"
    )
    for hardship in [] if result.dynamics is None else hardest(result.dynamics, above=1.0, most=3):
        console.print(f"physics: {hardship}", markup=False)
    for flight in [] if result.dynamics is None else flight_fit(result.dynamics):
        if abs(flight.rise - flight.ballistic_rise) > _OFF_FLIGHT:
            console.print(
                f"flight from {flight.start_s:.2f} to {flight.end_s:.2f} s rises {100 * flight.rise:.0f} cm; "
                f"gravity asks for {100 * flight.ballistic_rise:.0f} cm in that time"
            )
    for path in written:
        hint = f"   open it: rerun {path}" if path.suffix == ".rrd" else ""
        console.print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB){hint}", markup=False)
    if report.passed:
        console.print("[green]all gates hold[/]")
        return DONE
    console.print(f"[red]below the gate[/]: {', '.join(m.name for m in report.failures)}")
    return BELOW_GATE
