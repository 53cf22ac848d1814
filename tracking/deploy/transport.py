"""Unitree's LowState and LowCmd over DDS, by far-unitree-sdk: both ends of the wire.

Nothing is sent before the first command is written. The SDK then repeats the newest command at 500 Hz by itself, checks
every message's CRC and drops what fails, saying so on its standard output.
"""

from __future__ import annotations

import socket
import time
from typing import Any

import numpy as np

from robot_models import import_or_refuse
from tracking.deploy.guard import Command, State
from tracking.errors import TrackingError

MOTORS, MODE_MACHINE = 29, 5  # of a G1 with 29 joints
LOOPBACK = "lo"
CRC_COMPLAINT = "CRC Error"  # in what the SDK prints
# One machine, no multicast: not a packet leaves it.
_LOOPBACK_ONLY = """<CycloneDDS><Domain Id="any"><General>
<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


def _interface(name: str) -> Any:
    cure = "pip install 'dance-retarget[deploy]'"
    refusal = TrackingError("the robot's wires", found="no far-unitree-sdk", expected="it installed", cure=cure)
    sdk = import_or_refuse("unitree_interface", refusal)
    there = [found for _, found in socket.if_nameindex()]
    if name not in there:
        raise TrackingError(
            f"interface {name}", found="no such network interface", expected=f"one of {', '.join(there)}"
        )
    xml = {"dds_config": _LOOPBACK_ONLY} if name == LOOPBACK else {}
    return sdk.UnitreeInterface(name, sdk.RobotType.G1, sdk.MessageType.HG, **xml)


class ControllerTransport:
    """The controller's end."""

    def __init__(self, interface: str) -> None:
        self._sdk = _interface(interface)
        self._command = self._sdk.create_zero_command()
        self._pulse = 1e-6  # [N m]
        self._newest: tuple[np.ndarray, ...] = ()
        self._received = -np.inf

    def read(self) -> State | None:
        """The newest state; None before the first.

        Raises:
            TrackingError: the robot at the other end is not a G1 with 29 joints.
        """
        told = self._sdk.read_low_state()
        imu, motor = told.imu, told.motor
        numbers = tuple(np.array(x, dtype=float) for x in (imu.quat, imu.omega, motor.q, motor.dq))
        if not numbers[0].any():
            return None
        if told.mode_machine != MODE_MACHINE:
            raise TrackingError(
                "LowState, mode_machine",
                found=str(told.mode_machine),
                expected=f"{MODE_MACHINE}, a G1 with {MOTORS} joints",
            )
        # The message has no usable stamp: sensors of a living robot never repeat themselves to the last bit.
        if not self._newest or any(not np.array_equal(a, b) for a, b in zip(numbers, self._newest, strict=True)):
            self._newest, self._received = numbers, time.monotonic()
        quat, gyro, joint_pos, joint_vel = numbers
        return State(
            quat=quat, gyro=gyro, joint_pos=joint_pos[:MOTORS], joint_vel=joint_vel[:MOTORS], received=self._received
        )

    def write(self, command: Command) -> None:
        """Send; the SDK repeats it until the next."""
        c = self._command
        c.q_target, c.kp, c.kd = command.target.tolist(), command.kp.tolist(), command.kd.tolist()
        c.dq_target = [0.0] * MOTORS
        # A pulse: the SDK hands messages over without a stamp, and a standing robot is told the same for seconds.
        self._pulse = -self._pulse
        c.tau_ff = [self._pulse] + [0.0] * (MOTORS - 1)
        self._sdk.write_low_command(c)


class RobotTransport:
    """The robot's end, for rehearsals: on loopback and nowhere else."""

    def __init__(self) -> None:
        self._sdk = _interface(LOOPBACK)
        import unitree_interface as sdk

        self._state = sdk.LowState(MOTORS)
        self._state.mode_machine = MODE_MACHINE

    def publish(self, quat: np.ndarray, gyro: np.ndarray, joint_pos: np.ndarray, joint_vel: np.ndarray) -> None:
        """Tell what the sensors tell."""
        s = self._state
        s.imu.quat, s.imu.omega = quat.tolist(), gyro.tolist()
        s.motor.q, s.motor.dq = joint_pos.tolist(), joint_vel.tolist()
        self._sdk.publish_low_state(s)

    def command(self) -> tuple[Command, float]:
        """The newest command that came in, all zeros before the first; and its sender's pulse."""
        c = self._sdk.read_incoming_command()
        target, kp, kd = (np.array(x, dtype=float) for x in (c.q_target, c.kp, c.kd))
        return Command(target=target, kp=kp, kd=kd), float(c.tau_ff[0])
