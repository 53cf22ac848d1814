"""`dance-deploy`: a bundle on a robot's own wires: a dry run, a rehearsal on this machine, or a robot."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from cli.deploying import Arguments, check, checked, performance_verdict
from cli.shell import Background, command, make_console, tell

if TYPE_CHECKING:
    from tracking.deploy import Outlet, Performance, RobotLimits, StateReader


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
    from tracking.deploy import LOSS, Controller, Guard, GuardConfig, Stage, StageConfig, perform, stop_key

    runner, limits = checked(args, say)
    guard = Guard(limits, GuardConfig(loss=LOSS) if args.rehearse else None)
    controller = Controller(runner, guard, StageConfig(loops=args.loops, stand_s=args.stand))
    with stop_key() as stopped, _wires(args, log, limits, say) as (reader, outlet):
        stopped.begun = True
        say(
            f"listening on {args.interface}; {'commands follow' if args.send or args.rehearse else 'a dry run: nothing is sent'}"
        )
        return perform(
            controller, reader, outlet, stopped=stopped, parent=parent,
            tell=lambda stage, dances: say(
                f"{stage.value}{f' {dances + 1} of {args.loops}' if stage is Stage.DANCE else ''}"
            ),
        )  # fmt: skip


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
