"""Unitree's LowState and LowCmd over DDS, by far-unitree-sdk: both ends of the wire.

Nothing is sent before the first command is written. The SDK then repeats the newest command at 500 Hz by itself, checks
every message's CRC and drops what fails, saying so on its standard output.
"""

from __future__ import annotations

import os
import secrets
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from robot_models import import_or_refuse
from tracking.deploy.messages import Command, State
from tracking.errors import TrackingError

MODE_MACHINE = 5  # of a G1 with 29 joints
_SIDES = ("left", "right")
_LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
_ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")
MOTORS = (
    *(f"{side}_{joint}_joint" for side in _SIDES for joint in _LEG),
    *(f"waist_{axis}_joint" for axis in ("yaw", "roll", "pitch")),
    *(f"{side}_{joint}_joint" for side in _SIDES for joint in _ARM),
)
"""Joint of every motor in the order of the messages, as Unitree's manual numbers them (G1JointIndex 0 to 28)."""
LOOPBACK = "lo"
CRC_COMPLAINT = "CRC Error"  # in what the SDK prints
_POLL = 0.001  # between two looks for a new state [s]
_LOOK = 0.5  # for the commands of others [s]
_PATIENCE = 30.0  # for a simulated robot to begin [s]
# One machine, no multicast: not a packet leaves it. Who has another tag is not even discovered.
_LOOPBACK_ONLY = """<CycloneDDS><Domain Id="any"><General>
<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery>{tag}<ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


def _interface(name: str, tag: str = "") -> Any:
    cure = "pip install 'dance-retarget[deploy]'"
    refusal = TrackingError("the robot's wires", found="no far-unitree-sdk", expected="it installed", cure=cure)
    sdk = import_or_refuse("unitree_interface", refusal)
    there = [found for _, found in socket.if_nameindex()]
    if name not in there:
        raise TrackingError(
            f"interface {name}", found="no such network interface", expected=f"one of {', '.join(there)}"
        )
    own = _LOOPBACK_ONLY.format(tag=f"<Tag>{tag}</Tag>" if tag else "")
    xml = {"dds_config": own} if name == LOOPBACK else {}
    return sdk.UnitreeInterface(name, sdk.RobotType.G1, sdk.MessageType.HG, **xml)


def own_tag() -> str:
    """A name for one rehearsal that no other has."""
    return f"rehearsal-{os.getpid()}-{secrets.token_hex(8)}"


class ControllerTransport:
    """The controller's end: states in, commands out, both in the order of `joint_names`.

    Args:
        interface: network interface of the robot, `lo` for this machine alone.
        joint_names: order of the joints on this side; each goes to the motor of its name.
        tag: of the rehearsal that this belongs to; empty for whoever else is on that network.
        listen: look for states, a thousand times a second.

    Raises:
        TrackingError: no such interface, no SDK, or joints that are not the motors'.
    """

    def __init__(self, interface: str, joint_names: Sequence[str], *, tag: str = "", listen: bool = True) -> None:
        self._motor_of, self._joint_of = motor_order(joint_names)
        self._sdk = _interface(interface, tag)
        self._command = self._sdk.create_zero_command()
        self._pulse = 1e-6  # [N m]
        self._state: State | None = None
        self._mode = MODE_MACHINE
        if listen:
            threading.Thread(target=self._listen, daemon=True).start()

    def read(self) -> State | None:
        """The newest state; None before the first.

        Raises:
            TrackingError: the robot at the other end is not a G1 with 29 joints.
        """
        if self._mode != MODE_MACHINE:
            raise TrackingError(
                "LowState, mode_machine",
                found=str(self._mode),
                expected=f"{MODE_MACHINE}, a G1 with {len(MOTORS)} joints",
            )
        return self._state

    def wait_alone(self, ready: Callable[[float], bool]) -> None:
        """Until our own simulated robot has begun to speak; whoever speaks before it is not ours.

        Args:
            ready: whether it has, after so many seconds at the latest.

        Raises:
            TrackingError: a robot is on this wire already, or ours does not begin.
        """
        began = time.monotonic()
        while not ready(0.05):
            if self._state is not None:
                raise TrackingError(
                    "rehearsal", found="a robot that speaks on this wire already", expected="nobody but our own",
                    cure="end the other process first",
                )  # fmt: skip
            if time.monotonic() - began > _PATIENCE:
                raise TrackingError("rehearsal", found="no simulated robot", expected=f"one within {_PATIENCE:g} s")

    def refuse_other_commanders(self) -> None:
        """Look whether somebody else commands this robot, before we do.

        Raises:
            TrackingError: commands that are not ours are on the wire.
        """
        time.sleep(_LOOK)
        heard = self._sdk.read_incoming_command()
        if any(np.any(x) for x in (heard.kp, heard.kd, heard.q_target, heard.dq_target, heard.tau_ff)):
            raise TrackingError(
                "LowCmd", found="commands of somebody else on this wire", expected="nobody: two senders fight each other",
                cure="release the robot's own motion service (debug mode), and end other programs",
            )  # fmt: skip

    def write(self, command: Command) -> None:
        """Send; the SDK repeats it until the next."""
        c, order = self._command, self._joint_of
        c.q_target, c.kp, c.kd = (x[order].tolist() for x in (command.target, command.kp, command.kd))
        c.dq_target = [0.0] * len(MOTORS)
        # A pulse: the SDK hands messages over without a stamp, and a standing robot is told the same for seconds.
        self._pulse = -self._pulse
        c.tau_ff = [self._pulse] + [0.0] * (len(MOTORS) - 1)
        self._sdk.write_low_command(c)

    def _listen(self) -> None:
        """Keep the newest state. The message has no usable stamp: a living robot's sensors never repeat to the last bit."""
        last, arrivals = b"", deque[float]()
        while True:
            told, now = self._sdk.read_low_state(), time.monotonic()
            imu, motor = told.imu, told.motor
            numbers = [np.array(x, dtype=float) for x in (imu.quat, imu.omega, motor.q, motor.dq)]
            if numbers[0].any():
                seen = b"".join(x.tobytes() for x in numbers)
                if seen != last:
                    last = seen
                    arrivals.append(now)
                    while arrivals[0] < now - 1.0:
                        arrivals.popleft()
                    self._mode = told.mode_machine
                    self._state = self._made(numbers, told, now, float(len(arrivals)))
            time.sleep(_POLL)

    def _made(self, numbers: list[np.ndarray], told: Any, now: float, rate: float) -> State:
        quat, gyro, joint_pos, joint_vel = numbers
        order, motor = self._motor_of, told.motor
        torque, temperature, voltage = (np.array(x)[order] for x in (motor.tau_est, motor.temperature, motor.voltage))
        return State(
            quat=quat, gyro=gyro, joint_pos=joint_pos[order], joint_vel=joint_vel[order], received=now, torque=torque,
            temperature=temperature.astype(float), voltage=voltage,
            buttons=int(self._sdk.read_wireless_controller().keys), rate=rate,
        )  # fmt: skip


def motor_order(joint_names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Motor of every joint, and joint of every motor.

    Raises:
        TrackingError: names that are not the motors'.
    """
    if sorted(joint_names) != sorted(MOTORS):
        odd = sorted(set(joint_names) ^ set(MOTORS))
        raise TrackingError(
            "joints", found=f"{len(joint_names)} of them, {', '.join(odd[:3]) or 'some twice'} at odds",
            expected=f"the {len(MOTORS)} of a Unitree G1",
        )  # fmt: skip
    names = list(joint_names)
    return np.array([MOTORS.index(n) for n in names]), np.array([names.index(m) for m in MOTORS])


class RobotTransport:
    """The robot's end, for rehearsals: on loopback and nowhere else, joints in the motors' order.

    Args:
        tag: of the rehearsal.
    """

    def __init__(self, tag: str) -> None:
        self._sdk = _interface(LOOPBACK, tag)
        import unitree_interface as sdk

        self._state, self._remote = sdk.LowState(len(MOTORS)), sdk.WirelessController()
        self._state.mode_machine = MODE_MACHINE

    def publish(self, state: State) -> None:
        """Tell what the sensors tell."""
        s = self._state
        s.imu.quat, s.imu.omega = state.quat.tolist(), state.gyro.tolist()
        s.motor.q, s.motor.dq = state.joint_pos.tolist(), state.joint_vel.tolist()
        if state.torque is not None and state.temperature is not None and state.voltage is not None:
            s.motor.tau_est, s.motor.voltage = state.torque.tolist(), state.voltage.tolist()
            s.motor.temperature = state.temperature.astype(int).tolist()
        self._sdk.publish_low_state(s)
        if state.buttons != self._remote.keys:
            self._remote.keys = state.buttons
            self._sdk.publish_wireless_controller(self._remote)

    def command(self) -> tuple[Command, float]:
        """The newest command that came in, all zeros before the first; and its sender's pulse."""
        c = self._sdk.read_incoming_command()
        target, kp, kd = (np.array(x, dtype=float) for x in (c.q_target, c.kp, c.kd))
        return Command(target=target, kp=kp, kd=kd), float(c.tau_ff[0])
