"""The engines that a policy can be played in, and those that it can be trained in, by name."""

from __future__ import annotations

from functools import partial

from tracking.engines.mujoco import MujocoBatch
from tracking.engines.physics import Engine
from tracking.engines.physx import ISAAC, MOTOR, PhysxBatch
from tracking.engines.warp import WarpBatch
from tracking.errors import TrackingError

ENGINES: dict[str, Engine] = {
    "mujoco": MujocoBatch,
    "physx-isaac": partial(PhysxBatch, profile=ISAAC),
    "physx-motor": partial(PhysxBatch, profile=MOTOR),
}
TRAINING: dict[str, Engine] = {"mujoco": MujocoBatch, "warp": WarpBatch}
_GROUPS = {"physx": ("physx-isaac", "physx-motor"), "all": ("mujoco", "physx-isaac", "physx-motor")}


def engine_names(asked: str) -> tuple[str, ...]:
    """The engines that a name stands for: itself, both profiles of `physx`, or `all`."""
    names = _GROUPS.get(asked, (asked,))
    if not set(names) <= set(ENGINES):
        raise TrackingError(
            f"engine '{asked}'", found="no such engine", expected=f"one of {', '.join((*ENGINES, *_GROUPS))}"
        )
    return names


def training_engine(name: str) -> Engine:
    """An engine that can be trained in."""
    if name not in TRAINING:
        raise TrackingError(f"engine '{name}'", found="none to train in", expected=f"one of {', '.join(TRAINING)}")
    return TRAINING[name]
