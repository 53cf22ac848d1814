"""One performance: the controller's loop in real time, with its clock and its log."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from tracking.deploy.messages import State
from tracking.deploy.outlet import Outlet
from tracking.deploy.stages import Controller, Stage
from tracking.errors import TrackingError

_PATIENCE = 5.0  # for the first state [s]


@runtime_checkable
class StateReader(Protocol):
    """The controller's end of a robot's wires, for reading."""

    def read(self) -> State | None:
        """The newest state; None before the first."""


@dataclass(kw_only=True)
class Performance:
    """What a performance came to. Times are of the monotonic clock [s]."""

    ticks: list[float] = field(default_factory=list)  # when each command was ready
    thinking: list[float] = field(default_factory=list)  # how long it took [s]
    stages: list[tuple[float, str]] = field(default_factory=list)  # when each stage began
    rates: list[float] = field(default_factory=list)  # of the states that came in, at each tick [Hz]
    dances: int = 0
    tripped: str = ""

    def periods_ms(self) -> tuple[float, float, float]:
        """Median, 99th percentile and maximum of the time between commands [ms]."""
        gaps = 1e3 * np.diff(self.ticks)
        return (float(np.median(gaps)), float(np.percentile(gaps, 99)), float(gaps.max())) if len(gaps) else (0.0,) * 3


def perform(
    controller: Controller,
    reader: StateReader,
    outlet: Outlet,
    *,
    stopped: Callable[[], str] = lambda: "",
    tell: Callable[[Stage, int], None] = lambda *_: None,
    linger_s: float = 1.0,
    parent: int = 0,
) -> Performance:
    """Run the controller until it is over.

    Args:
        controller: what decides.
        reader: the robot's states.
        outlet: where commands go.
        stopped: by what a person or the system asks for the end; an empty word while nobody does.
        tell: told of every stage that begins.
        linger_s: how long the final damping is repeated [s].
        parent: process whose end is this one's; by default who it is now.

    Raises:
        TrackingError: no state comes in.
    """
    done, dt, parent = Performance(), controller.runner.contract.control_dt, parent or os.getppid()
    first = _first_state(reader, stopped)
    due, over_at = time.monotonic(), np.inf
    while time.monotonic() < over_at + linger_s:
        began = time.monotonic()
        orphaned = "" if os.getppid() == parent else "the parent process is gone"
        reason = stopped() or outlet.complaint() or orphaned
        if reason and controller.stage is not Stage.OVER:
            controller.stop(reason)
        state = reader.read() or first
        command = controller.tick(state, began, due)
        if controller.stage is Stage.OVER and over_at == np.inf:
            outlet.trip(controller.guard.tripped or "the end")
        outlet.write(command, state)
        done.ticks.append(time.monotonic())
        done.thinking.append(done.ticks[-1] - began)
        if state.rate is not None:
            done.rates.append(state.rate)
        if not done.stages or done.stages[-1][1] != controller.stage.value:
            done.stages.append((done.ticks[-1], controller.stage.value))
            tell(controller.stage, controller.dances)
        if controller.stage is Stage.OVER:
            over_at = min(over_at, done.ticks[-1])
        due += dt
        time.sleep(max(0.0, due - time.monotonic()))
    done.dances, done.tripped = controller.dances, controller.guard.tripped
    return done


def _first_state(reader: StateReader, stopped: Callable[[], str]) -> State:
    patience = time.monotonic() + _PATIENCE
    while (state := reader.read()) is None:
        if stopped():
            raise KeyboardInterrupt
        if time.monotonic() > patience:
            raise TrackingError(
                "LowState", found=f"none in {_PATIENCE:.0f} s", expected="a robot at the other end",
                cure="name the robot's network interface, or rehearse", option="rehearse", suggestion=" ",
            )  # fmt: skip
        time.sleep(0.01)
    return state
