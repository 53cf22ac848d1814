"""`dance-play`: a policy, or a reference alone, in MuJoCo's viewer or in a film."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

from cli import view
from cli.judging import followed, reference_for
from cli.recordings import FilmOptions, film_of, lost_song, show_live
from cli.shell import ClipPath, FileOptions, TellOptions, Verdict, command, tell
from robot_models import has_display


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Watch a policy dance in the simulator, live; or a reference, as it is. Without a display: on a page in the browser.

    Examples:
        dance-play groove-g1
        dance-play runs/groove
        dance-play runs/groove --film groove.mp4 --no-ghost
        dance-play groove-g1 --film groove.mp4 --audio song.mp3
        dance-play groove-g1 --film groove.mp4 --beside
        dance-play groove.npz
        dance-play tracker-g1 --ref dance_g1.npz
        dance-play tracker-g1 --dance groove
    """

    what: ClipPath
    """Folder of a policy bundle, the name of one that comes with the package (groove-dancer, groove-g1), a tracker
    with --ref or --dance (tracker-g1, tracker-dancer, or another lab's ONNX), or a reference (.npz) or any tool's motion of
    a robot: shown without physics."""
    ref: Path | None = None
    """What a tracker shall follow: any reference of its robot."""
    dance: str | None = None
    """The same by the name of a dance that the tracker knows; any other name tells which there are."""
    robot: str | None = None
    """Path of the robot's profile, where it is not a built-in one."""
    seed: int = 1
    """Seed of the sensors' noise."""
    picture: FilmOptions = field(default_factory=FilmOptions)
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-play`."""
    return command(Arguments, run, name="dance-play", argv=argv)


def run(args: Arguments) -> int:
    """Open what is named and show it: in a window, in a film, or on a page where there is no display for a window."""
    args.picture.check()
    if args.picture.film is None and not has_display() and find_spec("viser") is not None:
        return view.run(
            view.Arguments(
                what=(args.what,), robot=args.robot, ref=args.ref, dance=args.dance, file=args.file, tell=args.tell
            )
        )
    from tracking.evaluation import stream_policy, stream_reference

    with contextlib.ExitStack() as stack:
        console = args.tell.console()
        if args.what.is_file() and args.what.suffix not in (".onnx", ".pt", ".yaml"):
            motion = stack.enter_context(reference_for(args.what, args.file, console))
            show = stream_reference(motion or args.what, args.robot)
        else:
            ref = stack.enter_context(followed(args.what, args.ref, args.dance, args.file, console))
            show = stream_policy(args.what, args.robot, args.seed, ref)
        film = args.picture.film
        shown = show_live(show) if film is None else film_of(show, args.picture, args.what)
    fell = shown < show.frames
    how = ", then it fell" if fell else ""
    verdict = Verdict(
        passed=not fell,
        notes=lost_song(show, args.picture, args.what) if film is not None else (),
        line=f"{show.robot.name}: {shown / show.fps:.1f} of {show.frames / show.fps:.1f} s{how}",
        written=() if film is None else (film,),
    )
    return tell(verdict, args.tell)
