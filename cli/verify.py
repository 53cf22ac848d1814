"""`dance-verify`: is this reference whole, and does it still fit its robot and its source?"""

from __future__ import annotations

import hashlib
import importlib.util
from dataclasses import dataclass, field
from pathlib import Path

from cli.shell import ClipPath, TellOptions, Trouble, Verdict, command, line, tell
from clips import Reference, ReferenceFileError, is_reference, load_reference
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
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-verify`."""
    return command(Arguments, run, name="dance-verify", argv=argv)


def run(args: Arguments) -> int:
    """Check everything; what is broken is refused by `load_reference` itself."""
    if args.reference.is_file() and not is_reference(args.reference):
        raise ReferenceFileError(
            str(args.reference), found="no reference of this project", expected="one, with its report and hashes",
            cure=f"another tool's motion is judged as it stands: dance-report {args.reference}",
        )  # fmt: skip
    robot = load_robot(args.robot or load_reference(args.reference).robot)
    reference = load_reference(args.reference, robot)
    fine = [
        f"{reference.frames} frames at {reference.fps:g} fps, every key finite and of its shape",
        f"bodies follow from the joints of {robot.name}, hash {robot.hash[:12]}",
    ]
    wrong = [f"gate missed when it was made: {gate}" for gate in reference.failed_gates]
    for good, said in filter(None, (_torques(reference, robot), _source(args, reference))):
        (fine if good else wrong).append(said)
    if not reference.failed_gates:
        fine.append("gates: all held when it was made")
    verdict = Verdict(
        passed=not wrong,
        line=f"{args.reference}: {'whole, and what it was' if not wrong else f'whole, but not right: {len(wrong)} of its checks'}",
        notes=tuple(fine),
        troubles=tuple(Trouble(what=said) for said in wrong),
        steps=()
        if wrong
        else ((line("dance-train", "--ref", args.reference, "--check-ref"), "is it worth training on? seconds"),),
    )
    return tell(verdict, args.tell)


def _source(args: Arguments, reference: Reference) -> tuple[bool, str]:
    """Whether the clip that it was made from is still the same."""
    told = reference.meta.get("source", {})
    file = args.source or args.reference.with_name(str(told.get("file", "")))
    if not file.is_file():
        return True, f"made from {told.get('file', 'an unknown file')}, which is not here: name it with --source"
    same = hashlib.sha256(file.read_bytes()).hexdigest() == told.get("sha256")
    return same, f"{file} {'is what it was made from' if same else 'is not what it was made from: other bytes'}"


def _torques(reference: Reference, robot: RobotModel) -> tuple[bool, str]:
    """What the stored torques say beside the inverse dynamics of the motion, where Pinocchio is at hand."""
    if reference.joint_torque is None:
        return True, "no torques inside"
    if importlib.util.find_spec("pinocchio") is None:
        return True, "torques not compared: Pinocchio is not installed"
    from retarget.dynamics import torque_misfit

    off = torque_misfit(reference, robot)
    return off <= _TORQUE_TOLERANCE, f"torques {off:.1e} efforts off the inverse dynamics of the motion"
