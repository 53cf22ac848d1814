"""`dance-deploy`: a bundle on a robot's own wires: a dry run, a rehearsal on this machine, or a robot."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cli.deploying import Arguments, check, checked, performance_verdict
from cli.judging import followed
from cli.shell import Background, FileOptions, command, make_console, tell

if TYPE_CHECKING:
    from tracking.deploy import Outlet, Performance, RobotLimits, SongPlayer, Stage, StateReader


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-deploy`."""
    return command(Arguments, run, name="dance-deploy", argv=argv)


def run(args: Arguments) -> int:
    """Check, repeat the golden trace, perform, say what came of it."""
    from tracking.deploy import Rehearsed, performance_numbers, sdk_output_aside

    parent = os.getppid()
    check(args)
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        output = stack.enter_context(sdk_output_aside(folder / "controller.txt"))
        say = Background(make_console(stderr=True) if args.tell.json == Path("-") else make_console(file=output.people))
        stack.callback(say.close)
        if args.dance is not None:
            known = followed(args.bundle, args.ref, args.dance, FileOptions(), make_console(stderr=True))
            args = replace(args, ref=stack.enter_context(known))
        performance = _perform(args, folder / "robot", say, parent)
        say.close()
        rehearsed = Rehearsed.read(folder / "robot", performance) if args.rehearse else None
        numbers = performance_numbers(performance, output.complaints(), rehearsed)
        if args.recording is not None and rehearsed is not None:
            from cli.recordings import save_performance

            save_performance(args.recording, rehearsed, numbers)
    return tell(
        performance_verdict(numbers, args), args.tell, [f"{name:<36} {value}" for name, value in numbers.items()]
    )


def _perform(args: Arguments, log: Path, say: Callable[[str], None], parent: int) -> Performance:
    from tracking.deploy import LOSS, Controller, Guard, GuardConfig, StageConfig, perform, stop_key

    runner, limits = checked(args, say)
    guard = Guard(limits, GuardConfig(loss=LOSS) if args.rehearse else None)
    controller = Controller(runner, guard, StageConfig(loops=args.loops, stand_s=args.stand))
    with _song(args, say) as song, stop_key() as stopped, _wires(args, log, limits, say) as (reader, outlet):
        stopped.begun = True
        say(
            f"listening on {args.interface}; {'commands follow' if args.send or args.rehearse else 'a dry run: nothing is sent'}"
        )
        return perform(
            controller, reader, outlet, stopped=stopped, parent=parent,
            tell=lambda stage, dances: _told(stage, dances, args.loops, song, say),
        )  # fmt: skip


def _told(stage: Stage, dances: int, loops: int, song: SongPlayer | None, say: Callable[[str], None]) -> None:
    """A stage begins: the song with the dance, silence with every other."""
    dancing = stage.value == "dance"
    if song is not None:
        (song.begin if dancing else song.end)()
    say(f"{stage.value}{f' {dances + 1} of {loops}' if dancing else ''}")


@contextlib.contextmanager
def _song(args: Arguments, say: Callable[[str], None]) -> Iterator[SongPlayer | None]:
    """The song, ready to begin."""
    if args.music is None:
        yield None
        return
    from clips.music import music_of
    from tracking import load_bundle
    from tracking.deploy import SongPlayer

    reference = load_bundle(args.bundle, reference=args.ref).reference
    music, at_s = music_of(reference), args.music_at
    if at_s is None:
        at_s = reference.dance.start / reference.fps if music is None else music.song_at_s
    with SongPlayer(args.music, at_s, args.music_late) as song:
        say(f"{args.music.name} is ready; the loudspeaker is {1e3 * song.late_s:.0f} ms late, which is made up for")
        yield song


@contextlib.contextmanager
def _wires(
    args: Arguments, log: Path, limits: RobotLimits, say: Callable[[str], None]
) -> Iterator[tuple[StateReader, Outlet]]:
    """The robot's states, and where commands go; in a rehearsal with the simulated robot at the other end."""
    from tracking.deploy import ControllerTransport, DryOutlet, RehearsedFault, kept_outlet, own_tag, rehearsal_robot

    tag = own_tag() if args.rehearse else ""
    with contextlib.ExitStack() as stack:
        transport = ControllerTransport(args.interface, limits.joint_names, tag=tag)
        if not (args.rehearse or args.send):
            yield transport, DryOutlet(limits.joint_names, say)
            return
        if args.rehearse:
            fault = RehearsedFault(name=args.fault, after=args.fault_after) if args.fault else None
            ready = stack.enter_context(rehearsal_robot(log, tag, fault))
            transport.wait_alone(ready.wait)
        outlet = stack.enter_context(kept_outlet(args.interface, tag, transport, limits))
        if not args.rehearse:
            transport.refuse_other_commanders()
        yield transport, outlet
