"""The controller's way to the robot: through the keeper, and past it only when the keeper has died, and only to damp."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from robot_models.maths import rotation as rot
from tracking.deploy.keeper import ALIVE, END, LINGER, TRIP, CommandWriter, packed
from tracking.deploy.messages import Command, State
from tracking.deploy.robot_limits import RobotLimits
from tracking.errors import TrackingError

_HANGING = 0.05  # a keeper that has not spoken for this long: twenty-five of its rounds [s]
_TELL_S, _TELL = 0.5, 4  # between two lines of a dry run [s]; joints in one
_PATIENCE = 30.0  # for the keeper to begin [s]
_FAREWELL = 3.0  # for it to end [s]


@runtime_checkable
class Outlet(Protocol):
    """Where commands go."""

    def write(self, command: Command, state: State) -> None:
        """Send a command, chosen upon a state."""

    def trip(self, reason: str) -> None:
        """From now on nothing but damping."""

    def complaint(self) -> str:
        """Why nothing but damping goes out any more; empty while all is well."""


class DryOutlet:
    """Of a dry run: nothing goes out; what the robot tells is said twice a second, for a person who pushes its limbs.

    Args:
        joint_names: in the robot's order.
        say: told of the lean and of the joints that have moved most since the last line.
    """

    def __init__(self, joint_names: Sequence[str] = (), say: Callable[[str], None] = lambda _: None) -> None:
        self._names, self._say, self._next, self._last = joint_names, say, 0.0, np.zeros(len(joint_names))

    def write(self, _: Command, state: State) -> None:
        """Send nothing."""
        now = time.monotonic()
        if self._names and now >= self._next:
            self._next = now + _TELL_S
            moved = state.joint_pos - self._last
            most = np.argsort(-np.abs(moved))[:_TELL]
            joints = ", ".join(f"{self._names[j]} {round(np.degrees(state.joint_pos[j])):+d}" for j in most)
            roll, pitch = np.degrees(rot.roll_pitch(state.quat[None])[0])
            self._say(f"roll {round(roll):+d} pitch {round(pitch):+d}; {joints} deg")
            self._last = state.joint_pos

    def trip(self, reason: str) -> None:
        """Nothing to damp."""

    def complaint(self) -> str:
        """None, ever."""
        return ""


class KeptOutlet:
    """To the keeper, whose life is watched; when it ends or hangs it is killed and the robot damped from here.

    Args:
        process: the keeper's.
        channel: the socket to it.
        writer: a second way to the robot.
        limits: of the robot.
    """

    def __init__(
        self, process: subprocess.Popen[bytes], channel: socket.socket, writer: CommandWriter, limits: RobotLimits
    ) -> None:
        self._process, self._channel, self._writer, self._limits = process, channel, writer, limits
        self._alive, self._told, self._dead, self._commanded = time.monotonic(), "", "", False
        channel.setblocking(False)

    def write(self, command: Command, state: State) -> None:
        """Send; damping by the second way where the keeper is dead."""
        if self._listen():
            self._commanded = True
            self._send(packed(command, state.joint_pos))
        else:
            self._damp()

    def trip(self, reason: str) -> None:
        """From now on nothing but damping."""
        if self._listen():
            self._send(TRIP + reason.encode(errors="replace"))
        else:
            self._damp()

    def complaint(self) -> str:
        """Why nothing but damping goes out any more."""
        self._listen()
        return self._dead or self._told

    def end(self) -> None:
        """The performance is over: the keeper damps once more, and may go."""
        self._send(TRIP + b"the end")
        self._send(END)

    def see_off(self) -> None:
        """Wait for the keeper's end; one that does not come to it is killed, and the robot damped from here for a while."""
        try:
            self._process.wait(_FAREWELL)
        except subprocess.TimeoutExpired:
            self._give_up("the keeper does not end")
        if self._dead and self._commanded:
            self._damp()
            time.sleep(LINGER)  # the SDK repeats it for as long as this process lives

    def _damp(self) -> None:
        """Past the keeper; a robot that nobody has commanded is left alone."""
        if self._commanded:
            self._writer.write(self._limits.damping())

    def _send(self, message: bytes) -> None:
        try:
            self._channel.send(message)
        except OSError as e:  # its end, or a queue that it no longer empties
            self._give_up(f"the keeper takes no more commands ({e.strerror})")
            self._damp()

    def _listen(self) -> bool:
        """Whether the keeper lives; what it says is noted."""
        if self._dead:
            return False
        try:
            while message := self._channel.recv(1 << 16):
                self._alive, self._told = time.monotonic(), message.removeprefix(ALIVE).decode(errors="replace")
            self._give_up("the keeper died")
        except BlockingIOError:
            silent = time.monotonic() - self._alive
            if silent > _HANGING:
                self._give_up(f"the keeper hung for {1e3 * silent:.0f} ms")
        except OSError as e:
            self._give_up(f"the keeper died ({e.strerror})")
        return not self._dead

    def _give_up(self, reason: str) -> None:
        """Two may not write at once, and what hangs may yet wake up."""
        self._dead = self._dead or reason
        self._process.kill()

    def wait_until_ready(self) -> None:
        """Until the keeper's first sign of life.

        Raises:
            TrackingError: it died, or does not come.
        """
        began = time.monotonic()
        while time.monotonic() < began + _PATIENCE and self._process.poll() is None:
            with contextlib.suppress(BlockingIOError):
                if self._channel.recv(1 << 16):
                    self._alive = time.monotonic()
                    return
            time.sleep(0.01)
        raise TrackingError(
            "the keeper", found="no sign of life", expected="the process that damps the robot when this one fails",
            cure="look at what it wrote above",
        )  # fmt: skip


@contextlib.contextmanager
def kept_outlet(interface: str, tag: str, writer: CommandWriter, limits: RobotLimits) -> Iterator[KeptOutlet]:
    """A keeper's process in a session of its own, for as long as the block lasts.

    However the block ends the keeper damps; it ends at a word of ours, or by itself when the socket closes.
    """
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    begin = "from tracking.deploy.keeper import main; main()"
    # -P and the path of this very package: neither the current folder nor another installation is the keeper's code.
    words = [sys.executable, "-P", "-c", begin, str(its.fileno()), interface, tag]
    paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    env = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    process = subprocess.Popen(
        words, pass_fds=[its.fileno()], start_new_session=True, stdin=subprocess.DEVNULL, env=env
    )
    its.close()
    outlet = KeptOutlet(process, ours, writer, limits)
    try:
        outlet.wait_until_ready()
        yield outlet
        outlet.end()
    except BaseException as e:
        outlet.trip(f"the controller broke: {type(e).__name__}: {e}")
        raise
    finally:
        ours.close()
        outlet.see_off()
