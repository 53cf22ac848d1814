"""Deployment: a bundle on a robot's own wires, between a controller without a simulator and a robot, real or rehearsed."""

from tracking.deploy.guard import Guard
from tracking.deploy.loop import Performance, perform
from tracking.deploy.rehearsal import rehearsal_robot, run_robot
from tracking.deploy.rehearsal_log import Rehearsed, performance_numbers
from tracking.deploy.sdk_output import sdk_output_aside
from tracking.deploy.stages import Controller, Stage, StageConfig
from tracking.deploy.stopping import stop_key
from tracking.deploy.transport import CRC_COMPLAINT, MOTORS, ControllerTransport

__all__ = [
    "CRC_COMPLAINT",
    "MOTORS",
    "Controller",
    "ControllerTransport",
    "Guard",
    "Performance",
    "Rehearsed",
    "Stage",
    "StageConfig",
    "perform",
    "performance_numbers",
    "rehearsal_robot",
    "run_robot",
    "sdk_output_aside",
    "stop_key",
]
