"""`dance-deploy`: a bundle on a robot's own wires: a dry run, a rehearsal on this machine, or a robot."""

from __future__ import annotations

import contextlib
import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from cli.deploy_arguments import Arguments, check
from cli.terminal import BELOW_GATE, DONE, command
from clips import write_whole
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking.deploy import Performance


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-deploy`."""
    return command(Arguments, run, name="dance-deploy", argv=argv)


def run(args: Arguments) -> int:
    """Check, repeat the golden trace, perform, say what came of it."""
    from tracking.deploy import Rehearsed, performance_numbers, rehearsal_robot, sdk_output_aside

    check(args)
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        output = stack.enter_context(sdk_output_aside(folder / "controller.txt"))
        console = Console(highlight=False, soft_wrap=True, file=output.people)
        with rehearsal_robot(folder / "robot") if args.rehearse else contextlib.nullcontext():
            performance = _perform(args, console)
        rehearsed = Rehearsed.read(folder / "robot", performance) if args.rehearse else None
        numbers = performance_numbers(performance, output.complaints(), rehearsed)
        for name, value in numbers.items():
            console.print(f"{name:<36} {value}", markup=False)
        if args.json is not None:
            with write_whole(args.json) as stream:
                stream.write(json.dumps(numbers, indent=1).encode())
            console.print(f"wrote {args.json}", markup=False)
        if args.recording is not None and rehearsed is not None:
            from cli.recordings import save_performance

            save_performance(args.recording, rehearsed, numbers)
            console.print(f"wrote {args.recording}   open it: rerun {args.recording}", markup=False)
    wrong = bool(performance.tripped) or bool(numbers["messages with a bad CRC"]) or performance.dances < args.loops
    return BELOW_GATE if wrong or (rehearsed is not None and rehearsed.fell) else DONE


def _perform(args: Arguments, console: Console) -> Performance:
    from tracking import read_golden, replay
    from tracking.deploy import MOTORS, Controller, ControllerTransport, Guard, Stage, StageConfig, perform, stop_key
    from tracking.policy import GOLDEN, read_runner

    folder, runner = read_runner(args.bundle, args.ref)
    if len(runner.contract.joint_names) != MOTORS:
        raise TrackingError(
            f"bundle {args.bundle}", found=f"{len(runner.contract.joint_names)} joints of {runner.contract.robot}",
            expected=f"the {MOTORS} of a Unitree G1",
        )  # fmt: skip
    if runner.contract.follows_any:
        console.print(f"a tracker, on {args.ref}", markup=False)
    else:
        apart = replay(runner, read_golden(folder / GOLDEN))
        console.print(f"golden trace repeated to {apart:.1e}", markup=False)
    send = args.send or args.rehearse
    console.print("sending commands" if send else "dry run: nothing is sent", markup=False)
    config = StageConfig(loops=args.loops, stand_s=args.stand)
    controller = Controller(runner, Guard(runner.contract), config)
    with stop_key() as stopped:
        return perform(
            controller, ControllerTransport(args.interface), send=send, stopped=stopped.is_set,
            tell=lambda stage, dances: console.print(
                f"{stage.value}{f' {dances + 1} of {args.loops}' if stage is Stage.DANCE else ''}", markup=False
            ),
        )  # fmt: skip
