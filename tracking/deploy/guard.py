"""The guard between policy and wire: whatever looks wrong becomes damping, until a person resets it.

There is no fallback motion: a robot that does something else than asked has to become soft, not clever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.maths import rotation as rot
from tracking.policy import Contract


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """What one robot's wire tells at one instant, joints in the robot's order."""

    quat: Float[ndarray, "4"]  # IMU, wxyz
    gyro: Float[ndarray, "3"]  # [rad/s]
    joint_pos: Float[ndarray, "J"]  # [rad]
    joint_vel: Float[ndarray, "J"]  # [rad/s]
    received: float  # when a state that differs from the one before was first seen, monotonic clock [s]


@dataclass(frozen=True, kw_only=True, eq=False)
class Command:
    """What one robot's wire is told: servo targets and gains; damping where kp is zero."""

    target: Float[ndarray, "J"]  # [rad]
    kp: Float[ndarray, "J"]
    kd: Float[ndarray, "J"]


@dataclass(frozen=True, kw_only=True)
class GuardConfig:
    """Limits. Over 30 noisy rollouts of each shipped policy: jump 1.2, torque 1.8, speed 0.7 of their units."""

    tilt: float = 1.0  # of the IMU's z off the vertical [rad]
    speed: float = 1.0  # of the motors' own limit
    jump: float = 2.0  # of a target between two ticks, in effort / kp
    torque: float = 3.0  # that the servo law would ask for, in efforts
    beyond: float = 0.1  # of a joint beyond its range [rad]
    stale: float = 0.1  # age of the newest state [s]
    late: float = 0.1  # a tick after its time [s]


class Guard:
    """Looks at states and commands; the first thing wrong is kept as `tripped` until `reset`."""

    def __init__(self, contract: Contract, config: GuardConfig | None = None) -> None:
        self._c, self._config = contract, config or GuardConfig()
        self.tripped = ""
        self._target: ndarray | None = None

    def reset(self) -> None:
        """A person has looked and says: go on."""
        self.tripped, self._target = "", None

    def forget_target(self) -> None:
        """The next target may be anywhere: other servos are about to take over. What has tripped stays tripped."""
        self._target = None

    def trip(self, reason: str) -> None:
        """Latch; the first reason stays."""
        self.tripped = self.tripped or reason

    def state(self, state: State, now: float, due: float) -> bool:
        """Whether a state may be acted upon; now and due are the tick's real and meant times [s]."""
        limits, c = self._config, self._c
        numbers = np.concatenate((state.quat, state.gyro, state.joint_pos, state.joint_vel))
        joints = state.joint_pos.shape == state.joint_vel.shape == (len(c.joint_names),)
        if not joints:
            self.trip(f"state of {len(state.joint_pos)} joints where the contract has {len(c.joint_names)}")
        elif not np.isfinite(numbers).all() or abs(np.linalg.norm(state.quat) - 1.0) > 0.01:
            self.trip("corrupt state: numbers that are not finite, or no unit quaternion")
        elif now - state.received > limits.stale:
            self.trip(f"stale state: {1e3 * (now - state.received):.0f} ms old")
        elif now - due > limits.late:
            self.trip(f"late tick: {1e3 * (now - due):.0f} ms")
        else:
            self._body(state)
        return not self.tripped

    def _body(self, state: State) -> None:
        limits, c = self._config, self._c
        up = rot.rotate(rot.conjugate(state.quat), np.array((0.0, 0.0, 1.0)))[2]
        tilt = float(np.arccos(np.clip(up, -1.0, 1.0)))
        speed = np.abs(state.joint_vel) / c.velocity
        beyond = np.maximum(c.lower - state.joint_pos, state.joint_pos - c.upper)
        if tilt > limits.tilt:
            self.trip(f"tilt: {tilt:.2f} rad")
        elif speed.max() > limits.speed:
            self.trip(f"joint speed: {self._worst(speed)} at {speed.max():.2f} of its limit")
        elif beyond.max() > limits.beyond:
            self.trip(f"joint position: {self._worst(beyond)} {beyond.max():.2f} rad beyond its range")

    def command(self, command: Command, state: State) -> bool:
        """Whether a command may go out."""
        limits, c = self._config, self._c
        if not np.isfinite(np.concatenate((command.target, command.kp, command.kd))).all():
            self.trip("non-finite action")
            return False
        torque = np.abs(command.kp * (command.target - state.joint_pos) - command.kd * state.joint_vel) / c.effort
        jump = (
            np.zeros_like(torque) if self._target is None else np.abs(command.target - self._target) * c.kp / c.effort
        )
        if jump.max() > limits.jump:
            self.trip(f"target jump: {self._worst(jump)} by {jump.max():.1f} effort / kp")
        elif torque.max() > limits.torque:
            self.trip(f"torque estimate: {self._worst(torque)} at {torque.max():.1f} efforts")
        self._target = command.target
        return not self.tripped

    def _worst(self, values: Float[ndarray, "J"]) -> str:
        return self._c.joint_names[int(np.argmax(values))]
