"""Deployment: a bundle on a robot's own wires, between a controller without a simulator and a robot, real or rehearsed."""

from tracking.deploy.guard import Guard
from tracking.deploy.loop import Performance, perform
from tracking.deploy.rehearsal import run_robot
from tracking.deploy.stages import Controller, Stage, StageConfig
from tracking.deploy.transport import CRC_COMPLAINT, MOTORS, ControllerWire

__all__ = [
    "CRC_COMPLAINT",
    "MOTORS",
    "Controller",
    "ControllerWire",
    "Guard",
    "Performance",
    "Stage",
    "StageConfig",
    "perform",
    "run_robot",
]
