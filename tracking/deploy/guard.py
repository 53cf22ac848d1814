"""The guard between policy and wire: whatever looks wrong becomes damping, until a person resets it.

There is no fallback motion: a robot that does something else than asked has to become soft, not clever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import self_collisions
from robot_models.maths import rotation as rot
from tracking.deploy.messages import Command, State
from tracking.deploy.robot_limits import RobotLimits

_DOWN = np.array((0.0, 0.0, -1.0))
_FULL_S = 1.5  # until a second of states has been counted [s]
_UPRIGHT = np.array((1.0, 0.0, 0.0, 0.0))
_SELECT, _L2, _B = 1 << 3, 1 << 5, 1 << 9  # of the remote; select ends Unitree's own programs, L2 + B is its damping


@dataclass(frozen=True, kw_only=True)
class GuardConfig:
    """Limits and why they stand there. Seen: the largest in 30 noisy rollouts of groove-g1 (benchmarks/guard_margins.py).

    Lean is the angle between the robot's vertical and the one that the motion asks for; heading does not count.
    """

    tilt: float = 1.0  # of the IMU's z off the vertical [rad]: nobody dances there
    lean: float = 0.7  # held for `lean_s` [rad]; seen 0.16
    lean_s: float = 0.3
    falling: float = 0.6  # lean that grows faster than `falling_rate` [rad]: before the floor, not after
    falling_rate: float = 2.5  # [rad/s]
    gyro: float = 15.0  # [rad/s]; seen 1.7
    speed: float = 0.95  # of the motors' own limit; seen 0.14
    beyond: float = 0.1  # of a joint beyond its range [rad]
    torque: float = 3.0  # that the servo law would ask for, in efforts; seen 0.73
    jump: float = 2.0  # of a target between two ticks, in effort / kp; seen 0.46
    overlap: float = 0.06  # of two bodies in the commanded pose, held for `overlap_s` [m]; seen 0.026
    overlap_s: float = 0.1
    strain: float = (
        0.9  # measured torque in efforts, held for `strain_s`: a motor that pushes against something; seen 0.71
    )
    strain_s: float = 1.0
    temperature: float = 90.0  # of a motor [deg C]: ours to choose, the maker states none
    voltage: float = 41.6  # of the supply, 13 cells of 3.2 V each [V]: below them it collapses under load
    stale: float = 0.1  # age of the newest state [s]: five control periods
    loss: float = 0.15  # of the states of the best second so far, that no longer come
    rate: float = 200.0  # states a second, least [Hz]: four to a control period; the robot sends 500
    late: float = 0.1  # a tick after its time [s]


class Guard:
    """Looks at states and commands; the first thing wrong is kept as `tripped` until `reset`.

    Args:
        limits: of the robot that is about to move.
        config: thresholds.
    """

    def __init__(self, limits: RobotLimits, config: GuardConfig | None = None) -> None:
        self.limits, self._config = limits, config or GuardConfig()
        self.reset()

    def reset(self) -> None:
        """A person has looked and says: go on."""
        self.tripped, self._rate, self._began, self._lean = "", 0.0, np.inf, (0.0, -np.inf)
        self._since: dict[str, float] = {}  # when each thing that may not last began [s]
        self.forget_target()

    def forget_target(self) -> None:
        """The next target may be anywhere: other servos are about to take over. What has tripped stays tripped."""
        self._target: ndarray | None = None

    def trip(self, reason: str) -> None:
        """Latch; the first reason stays."""
        self.tripped = self.tripped or reason

    def state(self, state: State, now: float, due: float, meant: Float[ndarray, "4"] = _UPRIGHT) -> bool:
        """Whether a state may be acted upon.

        Args:
            state: the newest.
            now: monotonic clock [s].
            due: when this tick was meant to be [s].
            meant: orientation of the root that the motion asks for, wxyz; only its lean counts.
        """
        limits, joints = self._config, len(self.limits.joint_names)
        numbers = np.concatenate((state.quat, state.gyro, state.joint_pos, state.joint_vel))
        if not state.joint_pos.shape == state.joint_vel.shape == (joints,):
            self.trip(f"state of {len(state.joint_pos)} joints where the robot has {joints}")
        elif not np.isfinite(numbers).all() or abs(np.linalg.norm(state.quat) - 1.0) > 0.01:
            self.trip("corrupt state: numbers that are not finite, or no unit quaternion")
        elif state.buttons & _SELECT or state.buttons & (_L2 | _B) == _L2 | _B:
            self.trip("stopped by the remote")
        elif now - state.received > limits.stale:
            self.trip(f"stale state: {1e3 * (now - state.received):.0f} ms old")
        elif now - due > limits.late:
            self.trip(f"late tick: {1e3 * (now - due):.0f} ms")
        else:
            self._trunk(state, now, meant)
            self._joints(state)
            self._motors(state, now)
            self._messages(state, now)
        return not self.tripped

    def _trunk(self, state: State, now: float, meant: ndarray) -> None:
        limits = self._config
        down, wanted = (rot.rotate(rot.conjugate(quat), _DOWN) for quat in (state.quat, meant))
        tilt, lean = (float(np.arccos(np.clip(cosine, -1.0, 1.0))) for cosine in (-down[2], down @ wanted))
        (before, then), self._lean = self._lean, (lean, now)
        rate = (lean - before) / (now - then) if now > then else 0.0
        if tilt > limits.tilt:
            self.trip(f"tilt: {tilt:.2f} rad")
        elif lean > limits.falling and rate > limits.falling_rate:
            self.trip(f"falling: {lean:.2f} rad off the motion's vertical, {rate:.1f} rad/s")
        elif self._held("lean", lean > limits.lean, now, limits.lean_s):
            self.trip(f"lean: {lean:.2f} rad off the motion's vertical for {limits.lean_s:g} s")
        elif np.linalg.norm(state.gyro) > limits.gyro:
            self.trip(f"gyro: {np.linalg.norm(state.gyro):.1f} rad/s")

    def _joints(self, state: State) -> None:
        limits, robot = self._config, self.limits.robot
        speed = np.abs(state.joint_vel) / robot.velocity
        beyond = np.maximum(robot.lower - state.joint_pos, state.joint_pos - robot.upper)
        if speed.max() > limits.speed:
            self.trip(f"joint speed: {self._worst(speed)} at {speed.max():.2f} of its limit")
        elif beyond.max() > limits.beyond:
            self.trip(f"joint position: {self._worst(beyond)} {beyond.max():.2f} rad beyond its range")

    def _motors(self, state: State, now: float) -> None:
        limits = self._config
        if state.torque is not None:
            strain = np.abs(state.torque) / self.limits.robot.effort
            if self._held("strain", not strain.max() <= limits.strain, now, limits.strain_s):
                self.trip(
                    f"strain: {self._worst(strain)} at {strain.max():.2f} of its effort for {limits.strain_s:g} s"
                )
        if state.temperature is not None and state.temperature.max() > limits.temperature:
            self.trip(f"temperature: {self._worst(state.temperature)} at {state.temperature.max():.0f} deg C")
        told = (
            np.zeros(0) if state.voltage is None else state.voltage[state.voltage > 0.0]
        )  # zero where one does not tell it
        if told.size and told.min() < limits.voltage:
            self.trip(f"battery: {told.min():.1f} V")

    def _messages(self, state: State, now: float) -> None:
        if state.rate is None:
            return
        self._rate, self._began = max(self._rate, state.rate), min(self._began, now)
        if now - self._began > _FULL_S and state.rate < self._config.rate:
            self.trip(f"lost states: {state.rate:.0f} in a second")
        if state.rate < (1.0 - self._config.loss) * self._rate:
            self.trip(f"lost states: {state.rate:.0f} of {self._rate:.0f} in a second came in")

    def command(self, command: Command, state: State, now: float) -> bool:
        """Whether a command may go out."""
        limits, robot = self._config, self.limits.robot
        if not command.finite:
            self.trip("non-finite action")
            return False
        spring = command.kp * (command.target - state.joint_pos)
        torque = np.abs(spring - command.kd * state.joint_vel) / robot.effort
        moved = np.zeros_like(torque) if self._target is None else np.abs(command.target - self._target)
        jump = moved * command.kp / robot.effort
        if jump.max() > limits.jump:
            self.trip(f"target jump: {self._worst(jump)} by {jump.max():.1f} effort / kp")
        elif torque.max() > limits.torque:
            self.trip(f"torque estimate: {self._worst(torque)} at {torque.max():.1f} efforts")
        elif self._held("overlap", self._overlap(command) > limits.overlap, now, limits.overlap_s):
            self.trip(
                f"self-collision: the commanded pose has bodies more than {100 * limits.overlap:.0f} cm inside each other"
            )
        self._target = command.target
        return not self.tripped

    def _overlap(self, command: Command) -> float:
        """Deepest overlap of the robot's own bodies where the targets are, each in its joint's range [m]."""
        if not command.kp.any():
            return 0.0
        robot = self.limits.robot
        pose = robot.default_qpos.copy()
        pose[7:] = np.clip(command.target, robot.lower, robot.upper)
        return float(self_collisions(robot, pose[None]).depth[0])

    def _held(self, name: str, wrong: bool, now: float, seconds: float) -> bool:
        """Whether something has been wrong at every look for so long."""
        if not wrong:
            self._since.pop(name, None)
            return False
        return now - self._since.setdefault(name, now) >= seconds

    def _worst(self, values: Float[ndarray, "J"]) -> str:
        return self.limits.joint_names[int(np.argmax(values))]
