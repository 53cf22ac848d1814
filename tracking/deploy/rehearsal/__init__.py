"""A rehearsal: a simulated robot behind the robot's own messages, what it shall fall ill with, and its log."""

from tracking.deploy.rehearsal.faults import FAULTS
from tracking.deploy.rehearsal.log import Rehearsed, performance_numbers
from tracking.deploy.rehearsal.robot import LOSS, RehearsedFault, rehearsal_robot, run_robot

__all__ = ["FAULTS", "LOSS", "Rehearsed", "RehearsedFault", "performance_numbers", "rehearsal_robot", "run_robot"]
