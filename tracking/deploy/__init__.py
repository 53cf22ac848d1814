"""Deployment: a bundle on a robot's own wires, between a controller without a simulation and a robot, real or rehearsed."""

from tracking.deploy.guard import Guard, GuardConfig
from tracking.deploy.loop import Performance, StateReader, perform
from tracking.deploy.outlet import DryOutlet, Outlet, kept_outlet
from tracking.deploy.rehearsal import (
    FAULTS,
    LOSS,
    Rehearsed,
    RehearsedFault,
    performance_numbers,
    rehearsal_robot,
    run_robot,
)
from tracking.deploy.robot_limits import RobotLimits
from tracking.deploy.sdk_output import sdk_output_aside
from tracking.deploy.song import SongPlayer
from tracking.deploy.stages import Controller, Stage, StageConfig
from tracking.deploy.stopping import stop_key
from tracking.deploy.transport import CRC_COMPLAINT, ControllerTransport, own_tag

__all__ = [
    "CRC_COMPLAINT",
    "FAULTS",
    "LOSS",
    "Controller",
    "ControllerTransport",
    "DryOutlet",
    "Guard",
    "GuardConfig",
    "Outlet",
    "Performance",
    "Rehearsed",
    "RehearsedFault",
    "RobotLimits",
    "SongPlayer",
    "Stage",
    "StageConfig",
    "StateReader",
    "kept_outlet",
    "own_tag",
    "perform",
    "performance_numbers",
    "rehearsal_robot",
    "run_robot",
    "sdk_output_aside",
    "stop_key",
]
