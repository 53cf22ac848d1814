"""`dance-play`: a policy, or a reference alone, in MuJoCo's viewer or in a film."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cli.judging import reference_for
from cli.shell import ClipPath, FileOptions, TellOptions, Verdict, command, progress, tell
from clips import OutputError

if TYPE_CHECKING:
    from tracking.evaluation import PoseStream


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Watch a policy dance in the simulator, live; or a reference, as it is.

    Examples:
        dance-play groove-g1
        dance-play runs/groove
        dance-play runs/groove --film groove.mp4 --no-ghost
        dance-play groove-g1 --film groove.mp4 --audio song.mp3
        dance-play groove.npz
        dance-play tracker-g1 --ref dance_g1.npz
    """

    what: ClipPath
    """Folder of a policy bundle, the name of one that comes with the package (groove-dancer, groove-g1), a tracker
    with --ref (tracker-g1, or another lab's ONNX), or a reference (.npz) or any tool's motion of a robot: shown
    without physics."""
    ref: Path | None = None
    """What a tracker shall follow: any reference of its robot."""
    film: Path | None = None
    """Write a film (.mp4) and open no window; for machines without a display."""
    audio: Path | None = None
    """A song to be heard in the film."""
    audio_at: float | None = None
    """Second of the film at which the song begins; default: where the dance does. Below 0: so many of the song are skipped."""
    robot: str | None = None
    """Path of the robot's profile, where it is not a built-in one."""
    seed: int = 1
    """Seed of the sensors' noise."""
    ghost: bool = True
    """Show where the reference is, pale, in the film."""
    width: int = 960
    """Of the film, in pixels."""
    height: int = 720
    """Of the film, in pixels."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-play`."""
    return command(Arguments, run, name="dance-play", argv=argv)


def run(args: Arguments) -> int:
    """Open what is named and show it."""
    from cli.recordings import show_live

    if args.audio is not None and args.film is None:
        raise OutputError(
            "--audio", found="no film", expected="a film to be heard in", option="film", suggestion="out.mp4"
        )
    if args.audio is not None and not args.audio.is_file():
        raise OutputError(f"--audio {args.audio}", found="no such file", expected="a song")
    if args.film is not None and args.film.suffix != ".mp4":
        raise OutputError(f"--film {args.film}", found="that name", expected="a file that ends in .mp4")
    from tracking.evaluation import stream_policy, stream_reference

    with contextlib.ExitStack() as stack:
        console = args.tell.console()
        if args.what.is_file() and args.what.suffix not in (".onnx", ".pt", ".yaml"):
            motion = stack.enter_context(reference_for(args.what, args.file, console))
            show = stream_reference(motion or args.what, args.robot)
        else:
            ref = stack.enter_context(reference_for(args.ref, args.file, console))
            show = stream_policy(args.what, args.robot, args.seed, ref)
        shown = _film(show, args) if args.film is not None else show_live(show)
    fell = shown < show.frames
    how = ", then it fell" if fell else ""
    verdict = Verdict(
        passed=not fell,
        line=f"{show.robot.name}: {shown / show.fps:.1f} of {show.frames / show.fps:.1f} s{how}",
        written=() if args.film is None else (args.film,),
    )
    return tell(verdict, args.tell)


def _film(show: PoseStream, args: Arguments) -> int:
    from retarget.recordings import write_film

    poses = ((robot, ghost if args.ghost else None) for robot, ghost in show.poses)
    with progress("frames") as follow:
        return write_film(
            args.film or Path(), show.robot, poses, show.fps, (args.width, args.height),
            title=f"{args.what.stem} on {show.robot.name}", song=args.audio,
            song_at_s=show.begins_s if args.audio_at is None else args.audio_at, frames=show.frames, progress=follow,
        )  # fmt: skip
