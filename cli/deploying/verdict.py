"""What a performance came to, on a robot, in a rehearsal, or dry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cli.deploying.arguments import Arguments
from cli.shell import Trouble, Verdict, again, line

_BUSY = (
    "no command for",
    "the keeper hung",
    "lost states",
    "stale state",
    "late tick",
)  # what a machine's load looks like
_NOTICED = {  # what each fault is stopped for, where it is not for its own name
    "tilt": ("tilt", "falling", "lean"), "lean": ("lean", "falling"), "fall": ("falling", "lean"),
    "speed": ("joint speed",), "position": ("joint position", "joint speed"), "not-a-number": ("corrupt state",),
    "no-quaternion": ("corrupt state",), "silence": ("stale state", "lost states"),
    "frozen": ("stale state", "lost states"), "loss": ("lost states", "stale state"), "remote": ("stopped by the remote",),
}  # fmt: skip


def performance_verdict(numbers: Mapping[str, Any], args: Arguments) -> Verdict:
    """The verdict on a performance.

    Args:
        numbers: of it, as `performance_numbers` names them.
        args: what was asked for.
    """
    stopped, bad, fell = numbers["stopped by"], numbers["messages with a bad CRC"], numbers.get("fell", False)
    busy = stopped.startswith(_BUSY)
    wrong = [
        f"stopped by {stopped}; the robot was damped" if stopped != "nothing" else "",
        f"{bad} messages with a bad CRC" if bad else "",
        "the simulated robot fell" if fell else "",
        "not every dance was finished" if numbers["dances finished"] < args.loops else "",
    ]
    troubles = tuple(Trouble(what=said) for said in wrong if said)
    if args.fault and not bad and stopped.startswith(_NOTICED.get(args.fault, (args.fault,))):
        return _fault_verdict(stopped, numbers, args)
    if args.rehearse and busy:
        before = f", before {args.fault} came of it" if args.fault else ""
        cure = (
            f"the machine was too busy for 50 commands a second{before}: close what runs beside it, and again",
            again({}),
        )
        troubles = (replace(troubles[0], cures=(cure,)), *troubles[1:])
    where = "a rehearsal" if args.rehearse else "a robot" if args.send else "a dry run, nothing sent"
    median, late, worst = numbers["command period p50, p99, max [ms]"]
    written = () if args.recording is None else (args.recording,)
    look = (
        (line("rerun", args.recording), "look at it")
        if written
        else (again({"--recording": "rehearsal.rrd"}), "record it")
    )
    return Verdict(
        passed=not troubles,
        line=f"{args.bundle.name}, {where}: {numbers['dances finished']} of {args.loops} dances in {numbers['seconds']:.0f} s",
        numbers=(
            f"a command every {median} ms (99 %: {late}, most {worst})",
            f"states at {numbers['states heard in a second, least [Hz]']} Hz at least",
            f"stopped by {stopped}",
        ),
        troubles=troubles,
        written=written,
        steps=(look,) if args.rehearse else (),
        data=dict(numbers),
    )


def _fault_verdict(stopped: str, numbers: Mapping[str, Any], args: Arguments) -> Verdict:
    """The verdict on a fault that was noticed: that it ends the dance is what it was rehearsed for."""
    return Verdict(
        passed=True,
        line=f"{args.bundle.name}, a rehearsal of {args.fault}: noticed, and the robot was damped",
        numbers=(f"stopped by {stopped}", f"{numbers['dances finished']} of {args.loops} dances before"),
        written=() if args.recording is None else (args.recording,),
        steps=((line("rerun", args.recording), "look at it"),) if args.recording else (),
        data=dict(numbers),
    )
