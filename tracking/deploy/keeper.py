"""The keeper: a process of its own that alone writes to the robot, and damps it when the controller fails or falls silent.

Small on purpose. It knows the robot's own limits and nothing of policies; the controller reaches it by a socket, so that
whatever ends the controller (a signal, an exception, `kill -9`, a pause, a lost terminal) ends in damping here. What ends
the keeper is answered by the controller: see `outlet`.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import time
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from tracking.deploy.messages import Command
from tracking.deploy.robot_limits import RobotLimits

COMMAND, TRIP, END, ALIVE = b"C", b"T", b"E", b"A"
PERIOD = 0.002  # of the keeper's loop [s]
SILENCE = 0.07  # without a command, then damping: three and a half control periods [s]
FADE = 0.016  # from the last stiffness to none [s]
_LAST = 0.05  # for the last command to go out [s]
LINGER = 1.0  # damping goes on for so long after the controller is gone [s]
_ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
_LARGEST = 1 << 16  # message [bytes]


@runtime_checkable
class CommandWriter(Protocol):
    """The controller's end of a robot's wires, for writing."""

    def write(self, command: Command) -> None:
        """Send."""


def packed(command: Command, joint_pos: Float[ndarray, "J"]) -> bytes:
    """A command as the keeper takes it, and where the joints are: damping begins from there."""
    return COMMAND + np.concatenate((command.target, command.kp, command.kd, joint_pos)).astype(float).tobytes()


class Keeper:
    """What goes out, from what the controller says and when. A trip is latched; nothing chosen before passes after it.

    Args:
        limits: of the robot.
    """

    def __init__(self, limits: RobotLimits) -> None:
        self._limits, self._damping = limits, limits.damping()
        self._newest: Command | None = None  # not yet written
        self._joint_pos, self._kp = self._damping.target, np.zeros_like(self._damping.kp)
        self._heard = np.inf  # when the newest command came [s]; nothing is awaited before the first
        self.tripped, self._since = "", np.inf
        self.ended = False

    def hear(self, message: bytes, now: float) -> None:
        """One message of the controller's; an empty one is its end."""
        kind, rest = message[:1], message[1:]
        if kind == COMMAND:
            self._take(rest, now)
        elif kind == TRIP:
            self.trip(rest.decode(errors="replace"), now)
        elif kind == END:
            self.ended = True
        else:
            self.trip("the controller is gone", now)

    def trip(self, reason: str, now: float) -> None:
        """Latch; the first reason stays, and nothing that was chosen before goes out."""
        if not self.tripped:
            self.tripped, self._since, self._newest = reason, now, None

    def _take(self, rest: bytes, now: float) -> None:
        numbers = np.frombuffer(rest, dtype=float)
        if len(numbers) != 4 * len(self._damping.target):
            return self.trip(f"a command of {len(numbers)} numbers", now)
        target, kp, kd, joint_pos = numbers.reshape(4, -1)
        command = Command(target=target, kp=kp, kd=kd)
        if not command.finite:
            return self.trip("a command that is not finite", now)
        if not self.tripped:
            self._newest, self._heard, self._joint_pos = self._limits.bounded(command), now, joint_pos
        return None

    def command(self, now: float) -> Command | None:
        """What goes out now; None where nothing has to."""
        if now - self._heard > SILENCE:
            self.trip(f"no command for {1e3 * (now - self._heard):.0f} ms", now)
        if self.tripped:
            return self._fading(now)
        command, self._newest = self._newest, None
        if command is not None:
            self._kp = command.kp
        return command

    def farewell(self) -> Command | None:
        """The last word, however it came to the end; none where nothing was ever said."""
        return None if self._heard == np.inf else self._damping

    def _fading(self, now: float) -> Command | None:
        """Stiffness falls to none around where the joints were; a robot that was never told anything stays so."""
        if self._heard == np.inf:
            return None
        share = 1.0 - (now - self._since) / FADE
        if share <= 0.0 or not np.isfinite(self._joint_pos).all():
            return self._damping
        return self._limits.bounded(Command(target=self._joint_pos, kp=share * self._kp, kd=self._damping.kd))


def keep(channel: socket.socket, writer: CommandWriter, limits: RobotLimits) -> str:
    """Write what the controller sends until it ends, or damp until it is surely over; the reason of a trip, or none."""
    keeper, gone = Keeper(limits), np.inf
    for number in _ENDINGS:
        signal.signal(number, lambda n, _: keeper.trip(f"{signal.Signals(n).name} to the keeper", time.monotonic()))
    channel.setblocking(False)
    while not keeper.ended and time.monotonic() < gone + LINGER:
        now = time.monotonic()
        for message in _received(channel):
            keeper.hear(message, now)
            gone = min(gone, now) if not message else gone
        command = keeper.command(now)
        if command is not None:
            writer.write(command)
        _tell(channel, ALIVE + keeper.tripped.encode())
        time.sleep(PERIOD)
    last = keeper.farewell()
    if last is not None:
        writer.write(last)
        time.sleep(_LAST)
    return keeper.tripped


def _received(channel: socket.socket) -> list[bytes]:
    """Messages that wait; an empty one at the other end's end."""
    messages: list[bytes] = []
    try:
        while not messages or messages[-1]:
            messages.append(channel.recv(_LARGEST))
    except BlockingIOError:
        pass
    except OSError:
        messages.append(b"")
    return messages


def _tell(channel: socket.socket, message: bytes) -> None:
    """Without waiting: a controller that does not listen is no reason to stop."""
    with contextlib.suppress(OSError):
        channel.send(message)


def main() -> None:
    """Entry point of the process: file descriptor of the socket, network interface, tag of the rehearsal or an empty word."""
    from robot_models import load_robot
    from tracking.deploy.transport import ControllerTransport

    number, interface, tag = sys.argv[1:]
    limits = RobotLimits.of(load_robot("g1"))
    with socket.socket(fileno=int(number)) as channel:
        writer = ControllerTransport(interface, limits.joint_names, tag=tag, listen=False)
        reason = keep(channel, writer, limits)
    if reason == "the controller is gone":
        with contextlib.suppress(OSError):  # a terminal that is slow, or gone
            os.set_blocking(2, False)
            os.write(2, f"dance-deploy: {reason}; the robot was damped\n".encode())
