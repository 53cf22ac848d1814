"""One performance: the controller's loop in real time, with its clock, its watchdog and its log."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from tracking.deploy.guard import Command, State
from tracking.deploy.stages import Controller, Stage
from tracking.errors import TrackingError

_PATIENCE = 5.0  # for the first state [s]
_HANGING = 0.2  # a loop that has not come round for this long is taken for dead [s]


@runtime_checkable
class Transport(Protocol):
    """The controller's end of a wire."""

    def read(self) -> State | None:
        """The newest state."""

    def write(self, command: Command) -> None:
        """Send."""


@dataclass(kw_only=True)
class Performance:
    """What a performance came to. Times are of the monotonic clock [s]."""

    ticks: list[float] = field(default_factory=list)  # when each command was ready
    thinking: list[float] = field(default_factory=list)  # how long it took [s]
    stages: list[tuple[float, str]] = field(default_factory=list)  # when each stage began
    dances: int = 0
    tripped: str = ""

    def periods_ms(self) -> tuple[float, float, float]:
        """Median, 99th percentile and maximum of the time between commands [ms]."""
        gaps = 1e3 * np.diff(self.ticks)
        return (float(np.median(gaps)), float(np.percentile(gaps, 99)), float(gaps.max())) if len(gaps) else (0.0,) * 3


def perform(
    controller: Controller,
    transport: Transport,
    *,
    send: bool,
    stopped: Callable[[], bool] = lambda: False,
    tell: Callable[[Stage, int], None] = lambda *_: None,
    linger_s: float = 1.0,
) -> Performance:
    """Run the controller until it is over.

    Args:
        controller: what decides.
        transport: to the robot.
        send: write commands; otherwise everything is computed and nothing sent.
        stopped: whether a person pressed the stop key.
        tell: told of every stage that begins.
        linger_s: how long the final damping is repeated [s].

    Raises:
        TrackingError: no state comes in.
    """
    done, dt = Performance(), controller.runner.contract.control_dt
    first = _first_state(transport)
    due, over_at = time.monotonic(), np.inf
    gate, alive = _CommandGate(controller, transport if send else None), [due]
    watch = _watchdog(alive, controller, gate)
    try:
        while time.monotonic() < over_at + linger_s:
            began = time.monotonic()
            if stopped():
                controller.stop("stopped by a person")
            state = transport.read() or first
            command = controller.tick(state, began, due)
            gate.write(command)
            alive[0] = time.monotonic()
            done.ticks.append(alive[0])
            done.thinking.append(alive[0] - began)
            if not done.stages or done.stages[-1][1] != controller.stage.value:
                done.stages.append((alive[0], controller.stage.value))
                tell(controller.stage, controller.dances)
            if controller.stage is Stage.OVER:
                over_at = min(over_at, alive[0])
            due += dt
            time.sleep(max(0.0, due - time.monotonic()))
    except BaseException as e:
        # The SDK would repeat the last command for as long as the process lives.
        controller.stop(f"the controller broke: {e}")
        gate.write(controller.damping())
        raise
    finally:
        watch.set()
    done.dances, done.tripped = controller.dances, controller.guard.tripped
    return done


def _first_state(transport: Transport) -> State:
    patience = time.monotonic() + _PATIENCE
    while (state := transport.read()) is None:
        if time.monotonic() > patience:
            raise TrackingError(
                "LowState", found=f"none in {_PATIENCE:.0f} s", expected="a robot at the other end",
                cure="name the robot's network interface, or rehearse", option="rehearse", suggestion=" ",
            )  # fmt: skip
        time.sleep(0.01)
    return state


class _CommandGate:
    """The one way out: loop and watchdog take turns, and after a trip only damping passes."""

    def __init__(self, controller: Controller, transport: Transport | None) -> None:
        self._controller, self._wire, self._lock = controller, transport, threading.Lock()

    def write(self, command: Command) -> None:
        """Send, unless nothing is to be sent."""
        if self._wire is None:
            return
        free = self._lock.acquire(timeout=_HANGING)  # a write that hangs must not hold back the watchdog's damping
        try:
            self._wire.write(self._controller.damping() if self._controller.guard.tripped else command)
        finally:
            if free:
                self._lock.release()


def _watchdog(alive: list[float], controller: Controller, gate: _CommandGate) -> threading.Event:
    """The SDK repeats the newest command for ever: a loop that hangs must not leave a dancing one there."""
    end = threading.Event()

    def watch() -> None:
        while not end.wait(0.02):
            if time.monotonic() - alive[0] > _HANGING:
                controller.stop(f"the controller's loop hung for {_HANGING} s")
                gate.write(controller.damping())

    threading.Thread(target=watch, daemon=True).start()
    return end
