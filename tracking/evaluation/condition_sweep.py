"""How a policy stands what it was and was not trained for: one thing changed at a time, in every engine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from robot_models.maths import Progress, silent
from tracking.config import ObservationNoise, RandomisationConfig, TaskConfig
from tracking.engines import ENGINES
from tracking.evaluation.rollouts import Evaluation, evaluate, evaluation_task
from tracking.policy import load_bundle

NOMINAL = RandomisationConfig(
    friction=(1.0, 1.0),
    mass=(1.0, 1.0),
    torso_com=0.0,
    gains=(1.0, 1.0),
    encoder_bias=0.0,
    imu_mounting=0.0,
    torque_speed=False,
    delay=(0.0, 0.0),
    pushes=False,
)
_NOISE = ObservationNoise()
_PUSH = RandomisationConfig()


def _at(name: str, value: float) -> RandomisationConfig:
    change: dict[str, Any] = {name: (value, value)}
    return replace(NOMINAL, **change)


def _pushed(times: float) -> RandomisationConfig:
    x, y, z = _PUSH.push_linear
    roll, pitch, yaw = _PUSH.push_angular
    return replace(
        NOMINAL, pushes=True, push_linear=(times * x, times * y, times * z),
        push_angular=(times * roll, times * pitch, times * yaw),
    )  # fmt: skip


CONDITIONS: dict[str, tuple[RandomisationConfig, ObservationNoise]] = {
    "as trained, no pushes": (RandomisationConfig(pushes=False), _NOISE),
    "nominal": (NOMINAL, _NOISE),
    **{f"delay {ms} ms": (_at("delay", 1e-3 * ms), _NOISE) for ms in (10, 20, 30, 40)},
    **{f"gains {factor}": (_at("gains", factor), _NOISE) for factor in (0.8, 1.2)},
    **{f"friction {mu}": (_at("friction", mu), _NOISE) for mu in (0.3, 0.5, 0.8, 1.2)},
    **{f"mass {factor}": (_at("mass", factor), _NOISE) for factor in (0.8, 1.2)},
    "torque over speed as trained": (replace(NOMINAL, torque_speed=True), _NOISE),
    "motors a third as fast": (
        replace(NOMINAL, torque_speed=True, knee=(0.25, 0.25), no_load=(0.37, 0.37)),
        _NOISE,
    ),
    "pushes as trained": (_pushed(1.0), _NOISE),
    "pushes twice that": (_pushed(2.0), _NOISE),
    "encoder bias 0.03 rad": (replace(NOMINAL, encoder_bias=0.03), _NOISE),
    **{
        f"IMU turned by {deg} deg at most": (replace(NOMINAL, imu_mounting=math.radians(deg)), _NOISE) for deg in (1, 3)
    },
    "IMU noise doubled": (NOMINAL, replace(_NOISE, orientation=2 * _NOISE.orientation, gyro=2 * _NOISE.gyro)),
    "encoder noise doubled": (
        NOMINAL,
        replace(_NOISE, joint_position=2 * _NOISE.joint_position, joint_velocity=2 * _NOISE.joint_velocity),
    ),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell:
    """One condition in one engine."""

    condition: str
    engine: str
    result: Evaluation

    def as_dict(self) -> dict[str, object]:
        """For a file."""
        return {"condition": self.condition, "engine": self.engine, **self.result.as_dict()}


def under(condition: str, config: TaskConfig) -> TaskConfig:
    """The evaluation task under one of `CONDITIONS`."""
    draw, noise = CONDITIONS[condition]
    task = evaluation_task(replace(config, randomisation=draw, observation_noise=noise))
    return replace(task, randomisation=replace(task.randomisation, pushes=draw.pushes))


def sweep(
    bundle: Path,
    engines: Sequence[str],
    *,
    conditions: Sequence[str] = tuple(CONDITIONS),
    rollouts: int = 100,
    seed: int = 1,
    jobs: int = 1,
    reference: Path | None = None,
    robot: str | None = None,
    progress: Progress = silent,
) -> list[Cell]:
    """Evaluate a bundle under every condition in every engine.

    Args:
        bundle: as for `load_bundle`.
        engines: names in `ENGINES`.
        conditions: names in `CONDITIONS`.
        rollouts: of each.
        seed: of noise and robots, the same for all.
        jobs: processes, one rollout thread each.
        reference: as for `load_bundle`.
        robot: as for `load_bundle`.
        progress: told after every cell.
    """
    from joblib import Parallel, delayed

    # The slowest engine first, so that no process is left alone with it in the end.
    asked = [(c, e) for e in reversed(engines) for c in conditions]
    work = (delayed(_cell)(bundle, reference, robot, c, e, rollouts, seed) for c, e in asked)
    done: Iterator[Cell] = Parallel(n_jobs=jobs, return_as="generator_unordered")(work)
    cells = []
    for cell in done:
        cells.append(cell)
        progress("sweep", len(cells), len(asked))
    order = {pair: i for i, pair in enumerate((c, e) for c in conditions for e in engines)}
    return sorted(cells, key=lambda cell: order[cell.condition, cell.engine])


def _cell(
    path: Path, reference: Path | None, robot: str | None, condition: str, engine: str, rollouts: int, seed: int
) -> Cell:
    bundle = load_bundle(path, reference=reference, robot=robot)
    result = evaluate(
        bundle.runner, bundle.robot, bundle.reference, under(condition, TaskConfig()), rollouts=rollouts, seed=seed,
        threads=1, engine=ENGINES[engine],
    )  # fmt: skip
    return Cell(condition=condition, engine=engine, result=result)


def by_condition(cells: Sequence[Cell]) -> Mapping[str, Mapping[str, Cell]]:
    """Condition -> engine -> cell, in the order of the cells."""
    rows: dict[str, dict[str, Cell]] = {}
    for cell in cells:
        rows.setdefault(cell.condition, {})[cell.engine] = cell
    return rows
