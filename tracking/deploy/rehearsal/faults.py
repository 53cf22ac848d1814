"""What may go wrong at a robot, to be rehearsed: each fault changes what the simulated robot tells, or whether it does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from robot_models.maths import rotation as rot
from tracking.deploy.messages import State

Fault = Callable[[State, float, np.random.Generator], State | None]
"""The state as it is told, some seconds after the fault began; None where no message goes out."""


def _leaning(angle: float) -> np.ndarray:
    return rot.exp(np.array((0.0, angle, 0.0)))


def _first(values: np.ndarray, value: float) -> np.ndarray:
    return np.concatenate((values[:3], [value], values[4:]))


def _motors(name: str, value: float) -> Fault:
    def fault(state: State, _: float, __: np.random.Generator) -> State:
        values = np.zeros_like(state.joint_pos) if (told := getattr(state, name)) is None else told
        changed: dict[str, Any] = {name: _first(values, value)}
        return replace(state, **changed)

    return fault


def _always(change: Callable[[State], State | None]) -> Fault:
    return lambda state, _, __: change(state)


def _tilting(rate: float, most: float) -> Fault:
    return lambda state, seconds, _: replace(state, quat=_leaning(min(most, rate * seconds)))


def _frozen() -> Fault:
    kept: list[State] = []

    def fault(state: State, _: float, __: np.random.Generator) -> State:
        if not kept:
            kept.append(state)
        return kept[0]

    return fault


def faults() -> dict[str, Fault]:
    """Every fault by its name, none of them begun yet."""
    return {
        "tilt": _always(lambda s: replace(s, quat=_leaning(1.1))),
        "lean": _tilting(rate=2.0, most=0.95),
        "fall": _tilting(rate=4.0, most=0.95),
        "gyro": _always(lambda s: replace(s, gyro=np.array((0.0, 30.0, 0.0)))),
        "speed": _motors("joint_vel", 50.0),
        "position": _motors("joint_pos", 4.0),
        "not-a-number": _motors("joint_pos", np.nan),
        "no-quaternion": _always(lambda s: replace(s, quat=0.5 * s.quat)),
        "strain": _motors("torque", 139.0),
        "temperature": _motors("temperature", 105.0),
        "battery": _always(lambda s: replace(s, voltage=np.full_like(s.joint_pos, 38.0))),
        "remote": _always(lambda s: replace(s, buttons=1 << 3)),
        "silence": _always(lambda _: None),
        "frozen": _frozen(),
        "loss": lambda state, _, rng: state if rng.random() > 0.4 else None,
    }


FAULTS = tuple(faults())
