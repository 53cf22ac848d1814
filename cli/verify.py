"""`dance-verify`: is this reference whole, and does it still fit its robot and its source?"""

from __future__ import annotations

import hashlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path

from cli.shell import BELOW_GATE, DONE, ClipPath, command, make_console
from clips import Reference, load_reference
from robot_models import RobotModel, load_robot

_TORQUE_TOLERANCE = 1e-3  # efforts: single precision, and another machine's last bits


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Check a reference: keys and shapes, forward kinematics, the robot's hash, the source's hash, its gates.

    Examples:
        dance-verify dance_g1.npz
        dance-verify dance_g1.npz --source dance.bvh
    """

    reference: ClipPath
    """The reference (.npz)."""
    source: Path | None = None
    """The clip that it was made from; by default a file of its name beside it."""
    robot: str | None = None
    """Path of the robot's profile, where it is not a built-in one."""


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-verify`."""
    return command(Arguments, run, name="dance-verify", argv=argv)


def run(args: Arguments) -> int:
    """Check everything, one line each; what is broken is refused by `load_reference` itself."""
    console = make_console()
    robot = load_robot(args.robot or load_reference(args.reference).robot)
    reference = load_reference(args.reference, robot)
    console.print(f"ok    {reference.frames} frames at {reference.fps:g} fps, every key finite and of its shape")
    console.print(f"ok    bodies follow from the joints of {robot.name}, hash {robot.hash[:12]}")
    torques = _torques(reference, robot)
    console.print(torques)
    told = reference.meta.get("source", {})
    file = args.source or args.reference.with_name(str(told.get("file", "")))
    fine = True
    if file.is_file():
        fine = hashlib.sha256(file.read_bytes()).hexdigest() == told.get("sha256")
        said = "is what it was made from" if fine else "is not what it was made from: other bytes"
        console.print(f"{'ok   ' if fine else 'FAIL '} {file} {said}")
    else:
        console.print(
            f"-     made from {told.get('file', 'an unknown file')}, which is not here: name it with --source"
        )
    missed = reference.failed_gates
    console.print(f"{'FAIL ' if missed else 'ok   '} gates: {', '.join(missed) or 'all held when it was made'}")
    return DONE if fine and not missed and not torques.startswith("FAIL") else BELOW_GATE


def _torques(reference: Reference, robot: RobotModel) -> str:
    """What the stored torques say beside the inverse dynamics of the motion, where Pinocchio is at hand."""
    if reference.joint_torque is None:
        return "-     no torques inside"
    if importlib.util.find_spec("pinocchio") is None:
        return "-     torques not compared: Pinocchio is not installed"
    from retarget.dynamics import torque_misfit

    off = torque_misfit(reference, robot)
    fine = off <= _TORQUE_TOLERANCE
    return f"{'ok   ' if fine else 'FAIL '} torques {off:.1e} efforts off the inverse dynamics of the motion"
