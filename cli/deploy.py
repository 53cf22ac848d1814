"""`dance-deploy`: a bundle on a robot's own wires: a dry run, a rehearsal on this machine, or a robot."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from numpy import ndarray
from rich.console import Console

from cli.terminal import BELOW_GATE, DONE, ClipPath, command
from clips import write_whole
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking.deploy import Performance

_FALLEN = 0.5  # of the default height of the root


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Run a policy bundle over Unitree's DDS messages: damping, stand, dance, stand, damping.

    By default nothing is sent: states are read, commands computed and counted. With --rehearse a simulated robot answers
    on this machine's loopback, in a process of its own. A real robot needs --interface, --send and --confirm, a gantry,
    a remote in somebody's hand, and docs/robot.md read to its end.

    Enter or Ctrl-C stops at any time: damping, and nothing else until the command is given again.

    Examples:
        dance-deploy groove-g1 --rehearse
        dance-deploy groove-g1 --rehearse --loops 4 --recording rehearsal.rrd --json rehearsal.json
        dance-deploy groove-g1 --interface eth0
        dance-deploy groove-g1 --interface eth0 --send --confirm eth0
    """

    bundle: ClipPath
    """Folder of the bundle, or groove-g1."""
    rehearse: bool = False
    """Start a simulated robot on loopback, and send to it."""
    interface: str = "lo"
    """Network interface of the robot; lo, loopback, is this machine alone."""
    send: bool = False
    """Really send commands."""
    confirm: str | None = None
    """The interface's name once more, before anything is sent over a real one."""
    loops: int = 1
    """Dances, with a stand between them."""
    stand: float = 1.0
    """How long each stand lasts [s]."""
    json: Path | None = None
    """Write the numbers here."""
    recording: Path | None = None
    """Write a Rerun recording of the rehearsal here."""


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-deploy`."""
    return command(Arguments, run, name="dance-deploy", argv=argv)


def run(args: Arguments) -> int:
    """Check, repeat the golden trace, perform, say what came of it."""
    _check(args)
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        # The SDK talks on the process's standard output; what it complains of is counted there.
        talk = stack.enter_context(_sdk_talk(folder / "controller.txt"))
        console = Console(highlight=False, soft_wrap=True, file=talk.people)
        with _rehearsal_robot(folder / "robot") if args.rehearse else contextlib.nullcontext():
            performance = _perform(args, console)
        rehearsed = Rehearsed.read(folder / "robot", performance) if args.rehearse else None
        told = _numbers(performance, talk.complaints(), rehearsed)
        for name, value in told.items():
            console.print(f"{name:<36} {value}", markup=False)
        if args.json is not None:
            with write_whole(args.json) as stream:
                stream.write(json.dumps(told, indent=1).encode())
            console.print(f"wrote {args.json}", markup=False)
        if args.recording is not None and rehearsed is not None:
            _record(args, rehearsed, told)
            console.print(f"wrote {args.recording}   open it: rerun {args.recording}", markup=False)
    wrong = bool(performance.tripped) or bool(told["messages with a bad CRC"]) or performance.dances < args.loops
    return BELOW_GATE if wrong or (rehearsed is not None and rehearsed.fell) else DONE


def _check(args: Arguments) -> None:
    if args.rehearse and args.interface != "lo":
        raise TrackingError(
            "--rehearse", found=f"--interface {args.interface}", expected="a rehearsal on loopback alone"
        )
    if args.send and args.interface != "lo" and args.confirm != args.interface:
        raise TrackingError(
            "--send", found=f"commands to whatever is on {args.interface}",
            expected="the interface's name once more, from somebody who stands by the robot with a remote",
            option="confirm", suggestion=args.interface,
        )  # fmt: skip
    if args.recording is not None and not args.rehearse:
        raise TrackingError(
            "--recording", found="no rehearsal", expected="--rehearse: a real robot has no cameras here"
        )
    if args.loops < 1 or args.stand <= 0.0:
        raise TrackingError("--loops, --stand", found=f"{args.loops}, {args.stand}", expected="positive numbers")


def _perform(args: Arguments, console: Console) -> Performance:
    from tracking import read_golden, replay
    from tracking.deploy import MOTORS, Controller, ControllerWire, Guard, Stage, StageConfig, perform
    from tracking.policy import GOLDEN, read_runner

    folder, runner = read_runner(args.bundle)
    if len(runner.contract.joint_names) != MOTORS:
        raise TrackingError(
            f"bundle {args.bundle}", found=f"{len(runner.contract.joint_names)} joints of {runner.contract.robot}",
            expected=f"the {MOTORS} of a Unitree G1",
        )  # fmt: skip
    apart = replay(runner, read_golden(folder / GOLDEN))
    console.print(f"golden trace repeated to {apart:.1e}", markup=False)
    send = args.send or args.rehearse
    console.print("sending commands" if send else "dry run: nothing is sent", markup=False)
    config = StageConfig(loops=args.loops, stand_s=args.stand)
    controller = Controller(runner, Guard(runner.contract), config)
    with _stop_key() as stopped:
        return perform(
            controller, ControllerWire(args.interface), send=send, stopped=stopped.is_set,
            tell=lambda stage, dances: console.print(
                f"{stage.value}{f' {dances + 1} of {args.loops}' if stage is Stage.DANCE else ''}", markup=False
            ),
        )  # fmt: skip


@contextlib.contextmanager
def _stop_key() -> Iterator[threading.Event]:
    """Set by Enter and by Ctrl-C."""
    pressed = threading.Event()

    def wait() -> None:
        if sys.stdin.readline():  # empty at the end of a file: nobody is there
            pressed.set()

    if sys.stdin is not None and sys.stdin.isatty():
        threading.Thread(target=wait, daemon=True).start()
    before = signal.signal(signal.SIGINT, lambda *_: pressed.set())
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)


@dataclass(frozen=True, kw_only=True)
class _Talk:
    """What was the standard output, and the file that took its place for the SDK."""

    people: TextIO
    file: Path

    def complaints(self) -> int:
        """Messages that the SDK dropped for their CRC, at both ends."""
        from tracking.deploy import CRC_COMPLAINT

        files = (self.file, *self.file.parent.glob("robot*.txt"))
        return sum(f.read_text(errors="replace").count(CRC_COMPLAINT) for f in files)


@contextlib.contextmanager
def _sdk_talk(path: Path) -> Iterator[_Talk]:
    sys.stdout.flush()
    kept = os.dup(1)
    with open(path, "wb") as file:
        os.dup2(file.fileno(), 1)
    try:
        with os.fdopen(os.dup(kept), "w") as people:
            yield _Talk(people=people, file=path)
    finally:
        os.dup2(kept, 1)
        os.close(kept)


@contextlib.contextmanager
def _rehearsal_robot(at: Path) -> Iterator[None]:
    """The simulated robot's process, for as long as the block lasts."""
    from tracking.deploy import run_robot

    fresh = multiprocessing.get_context("spawn")
    stop = fresh.Event()
    process = fresh.Process(target=run_robot, args=("g1", at, stop), daemon=True)
    process.start()
    try:
        yield
    finally:
        stop.set()
        process.join(10.0)
        process.kill()


@dataclass(frozen=True, kw_only=True, eq=False)
class Rehearsed:
    """What the simulated robot did, until the last damping began."""

    qpos: ndarray  # (N, nq) at 50 Hz
    stage: ndarray  # (N,): 0 damping, 1 stand, 2 dance
    command_age: ndarray  # of every state period [s]

    @property
    def upright(self) -> ndarray:
        """z of the root's up axis."""
        from robot_models.maths import rotation as rot

        return rot.rotate(self.qpos[:, 3:7], np.array((0.0, 0.0, 1.0)))[:, 2]

    @property
    def fell(self) -> bool:
        """Whether the root was ever low or lying."""
        from robot_models import load_robot

        low = self.qpos[:, 2] < _FALLEN * load_robot("g1").default_qpos[2]
        return bool((low | (self.upright < 0.5)).any())

    @classmethod
    def read(cls, path: Path, performance: Performance) -> Rehearsed:
        """Read the robot's log."""
        names = ("damping", "stand", "dance", "over")
        began = np.array([t for t, _ in performance.stages])
        kind = np.array([names.index(stage) for _, stage in performance.stages])
        with np.load(path.with_suffix(".npz")) as log:
            at = np.searchsorted(began, log["time"], side="right") - 1
            meant = (at >= 0) & (kind[np.maximum(at, 0)] < names.index("over"))
            return cls(qpos=log["qpos"][meant], stage=kind[at[meant]].astype(float), command_age=log["age"])


def _numbers(performance: Performance, bad: int, rehearsed: Rehearsed | None) -> dict[str, Any]:
    median, late, worst = performance.periods_ms()
    thinking = 1e3 * np.array(performance.thinking)
    told: dict[str, Any] = {
        "seconds": round(performance.ticks[-1] - performance.ticks[0], 2),
        "dances finished": performance.dances,
        "stopped by": performance.tripped or "nothing",
        "messages with a bad CRC": bad,
        "command period p50, p99, max [ms]": [round(x, 2) for x in (median, late, worst)],
        "controller's tick p50, p99 [ms]": [round(float(x), 2) for x in np.percentile(thinking, (50, 99))],
    }
    if rehearsed is not None:
        ages = 1e3 * np.percentile(rehearsed.command_age, (50, 99)) if len(rehearsed.command_age) else np.zeros(2)
        told["command's age at the robot p50, p99 [ms]"] = [round(float(x), 2) for x in ages]
        told["fell"] = rehearsed.fell
    return told


def _record(args: Arguments, rehearsed: Rehearsed, told: dict[str, Any]) -> None:
    from cli.recordings import save_rehearsal
    from robot_models import load_robot

    rows = "\n".join(f"| {name} | {value} |" for name, value in told.items())
    series = {
        "root height [m]": rehearsed.qpos[:, 2],
        "tilt [rad]": np.arccos(np.clip(rehearsed.upright, -1.0, 1.0)),
        "stage: 0 damping, 1 stand, 2 dance": rehearsed.stage,
    }
    text = f"# Rehearsal\n| | |\n|---|---|\n{rows}"
    save_rehearsal(args.recording or Path(), load_robot("g1"), rehearsed.qpos, 50.0, series, text)
