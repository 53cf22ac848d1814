"""Physics engines behind one protocol, and what reads bodies and drives motors in them."""

from tracking.engines.actuators import limit_torque_by_speed
from tracking.engines.mujoco import MujocoBatch, floor_geoms, training_model
from tracking.engines.physics import Engine
from tracking.engines.random import Rng
from tracking.engines.registry import ENGINES, engine_names, training_engine
from tracking.engines.warp import WarpBatch

__all__ = [
    "ENGINES",
    "Engine",
    "MujocoBatch",
    "Rng",
    "WarpBatch",
    "engine_names",
    "floor_geoms",
    "limit_torque_by_speed",
    "training_engine",
    "training_model",
]
