"""What the simulated robot of a rehearsal did, and what a performance came to in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.deploy.loop import Performance
from tracking.errors import TrackingError

_FALLEN = 0.5  # of the default height of the root
_WARMED_UP = 50  # ticks until a second of states is counted


@dataclass(frozen=True, kw_only=True, eq=False)
class Rehearsed:
    """What the simulated robot did, until the last damping began."""

    qpos: Float[ndarray, "N nq"]  # at 50 Hz
    stage: Float[ndarray, "N"]  # 0 damping, 1 stand, 2 dance
    command_age: Float[ndarray, "P"]  # of every state period [s]

    @property
    def upright(self) -> Float[ndarray, "N"]:
        """z of the root's up axis."""
        return rot.rotate(self.qpos[:, 3:7], np.array((0.0, 0.0, 1.0)))[:, 2]

    @property
    def fell(self) -> bool:
        """Whether the root was ever low or lying."""
        low = self.qpos[:, 2] < _FALLEN * load_robot("g1").default_qpos[2]
        return bool((low | (self.upright < 0.5)).any())

    @property
    def series(self) -> dict[str, Float[ndarray, "N"]]:
        """Curves for a recording, by name."""
        return {
            "root height [m]": self.qpos[:, 2],
            "tilt [rad]": np.arccos(np.clip(self.upright, -1.0, 1.0)),
            "stage: 0 damping, 1 stand, 2 dance": self.stage,
        }

    @classmethod
    def read(cls, path: Path, performance: Performance) -> Rehearsed:
        """Read the robot's log."""
        if not path.with_suffix(".npz").exists():
            raise TrackingError("rehearsal", found="no log of the simulated robot", expected="it to end by itself")
        names = ("damping", "stand", "dance", "over")
        began = np.array([t for t, _ in performance.stages])
        kind = np.array([names.index(stage) for _, stage in performance.stages])
        with np.load(path.with_suffix(".npz")) as log:
            at = np.searchsorted(began, log["time"], side="right") - 1
            meant = (at >= 0) & (kind[np.maximum(at, 0)] < names.index("over"))
            return cls(qpos=log["qpos"][meant], stage=kind[at[meant]].astype(float), command_age=log["age"])


def performance_numbers(performance: Performance, bad: int, rehearsed: Rehearsed | None) -> dict[str, Any]:
    """For people and files: times, trips, bad messages, and how a rehearsal's robot fared."""
    median, late, worst = performance.periods_ms()
    thinking = 1e3 * np.array(performance.thinking)
    told: dict[str, Any] = {
        "seconds": round(performance.ticks[-1] - performance.ticks[0], 2),
        "dances finished": performance.dances,
        "stopped by": performance.tripped or "nothing",
        "messages with a bad CRC": bad,
        "command period p50, p99, max [ms]": [round(x, 2) for x in (median, late, worst)],
        "states heard in a second, least [Hz]": round(min(performance.rates[_WARMED_UP:], default=0.0)),
        "controller's tick p50, p99 [ms]": [round(float(x), 2) for x in np.percentile(thinking, (50, 99))],
    }
    if rehearsed is not None:
        ages = 1e3 * np.percentile(rehearsed.command_age, (50, 99)) if len(rehearsed.command_age) else np.zeros(2)
        told["command's age at the robot p50, p99 [ms]"] = [round(float(x), 2) for x in ages]
        told["fell"] = rehearsed.fell
    return told
