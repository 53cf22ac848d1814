"""A rehearsal: a simulated robot behind the robot's own messages, what it shall fall ill with, and its log."""

from tracking.deploy.rehearsal.faults import FAULTS
from tracking.deploy.rehearsal.log import Rehearsed, performance_numbers
from tracking.deploy.rehearsal.robot import (
    LOSS,
    STATE_DT,
    RehearsedFault,
    SimulatedBody,
    rehearsal_robot,
    run_robot,
    sensed,
)

__all__ = [
    "FAULTS",
    "LOSS",
    "STATE_DT",
    "Rehearsed",
    "RehearsedFault",
    "SimulatedBody",
    "performance_numbers",
    "rehearsal_robot",
    "run_robot",
    "sensed",
]
