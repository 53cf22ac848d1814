"""The robot of a rehearsal: MuJoCo in real time behind Unitree's messages, in a process of its own.

It tells what sensors tell and no more, evaluates the servo law at every physics step, hangs on a gantry until the first
command, and goes to damping when commands stop coming.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robot_models import RobotModel, load_robot
from robot_models.maths import rotation as rot
from tracking.config import ObservationNoise
from tracking.deploy.messages import State
from tracking.deploy.rehearsal.faults import faults

if TYPE_CHECKING:
    import mujoco

LOSS = 0.3  # of its states: on a busy computer it stumbles by itself; a robot's own computer does not
STATE_DT = 0.002  # between two states: 500 Hz [s]
_SUBSTEPS = 2  # physics steps in between
_SILENCE = 0.2  # without a new command, then damping [s]
_MOURNING = 3.0  # after the controller is gone, then the log is written [s]
_WARM, _CHARGED = 40.0, 48.0  # motors [deg C] and supply [V] of a robot that has nothing


@dataclass(frozen=True, kw_only=True)
class SensorNoise:
    """Half widths of uniform noise: a tenth of what policies are trained with, for gyro and velocities a fifth."""

    orientation: float = 0.1 * ObservationNoise.orientation  # [rad]
    gyro: float = 0.2 * ObservationNoise.gyro  # [rad/s]
    joint_pos: float = 0.1 * ObservationNoise.joint_position  # [rad]
    joint_vel: float = 0.2 * ObservationNoise.joint_velocity  # [rad/s]


@dataclass(frozen=True, kw_only=True)
class RehearsedFault:
    """One thing that goes wrong at the robot."""

    name: str  # one of `FAULTS`
    after: float  # the first command with stiffness [s]


@dataclass(kw_only=True)
class _Log:
    """What the robot did and was told; times are of the monotonic clock, which all processes share."""

    qpos: list[np.ndarray] = field(default_factory=list)  # at 50 Hz
    time: list[float] = field(default_factory=list)
    heard: list[float] = field(default_factory=list)  # when each command that differs from the one before was seen
    kp: list[float] = field(default_factory=list)  # its largest stiffness
    kd: list[float] = field(default_factory=list)  # and its least damping
    age: list[float] = field(default_factory=list)  # of the newest command, at every state period
    fault_at: float = np.inf

    def write(self, path: Path) -> None:
        """Everything, as arrays by name."""
        arrays: dict[str, Any] = {name: np.array(value) for name, value in vars(self).items()}
        np.savez(path, **arrays)


def run_robot(
    robot_name: str, log: Path, stop: Event, ready: Event, tag: str, fault: RehearsedFault | None = None, seed: int = 0
) -> None:
    """Be the robot until told to stop; then write what happened to `log`.npz, and what the SDK said to `log`.txt."""
    from tracking.deploy.transport import RobotTransport

    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # they are the controller's to answer
    with open(log.with_suffix(".txt"), "wb") as talk:
        os.dup2(talk.fileno(), 1)
    robot, rng = load_robot(robot_name), np.random.default_rng(seed)
    transport, body, told = RobotTransport(tag), SimulatedBody(robot), _Log()
    illness = faults()[fault.name] if fault is not None else None
    pulse, changed, stiff_at = 0.0, time.monotonic(), np.inf
    parent = multiprocessing.parent_process()
    due, step, alone = time.monotonic(), 0, np.inf
    ready.set()
    while not stop.is_set() and time.monotonic() < alone + _MOURNING:
        if parent is not None and os.getppid() != parent.pid:
            alone = min(alone, time.monotonic())
        (command, beat), now = transport.command(), time.monotonic()
        if beat != pulse:
            pulse, changed = beat, now
            told.heard.append(now)
            told.kp.append(float(command.kp.max()))
            told.kd.append(float(command.kd.min()))
        if command.kp.any():
            stiff_at = min(stiff_at, now)
        if stiff_at < np.inf:
            quiet = now - changed > _SILENCE
            body.step(np.zeros_like(command.kp) if quiet else command.kp, command.kd, command.target)
            told.age.append(now - changed)
        state: State | None = sensed(body, rng)
        if fault is not None and illness is not None and state is not None and now > stiff_at + fault.after:
            told.fault_at = min(told.fault_at, now)
            state = illness(state, now - told.fault_at, rng)
        if state is not None:
            transport.publish(state)
        step += 1
        if step % 10 == 0:
            told.qpos.append(body.qpos)
            told.time.append(now)
        due += STATE_DT
        time.sleep(max(0.0, due - time.monotonic()))
        if time.monotonic() - due > 0.5:  # the machine stood still: time goes on from here
            due = time.monotonic()
    told.write(log.with_suffix(".npz"))


class SimulatedBody:
    """The physics: torques of the servo law, clipped to the motors' effort, at every step."""

    def __init__(self, robot: RobotModel) -> None:
        import mujoco

        self._mujoco, self._effort = mujoco, robot.effort
        self._model = _torque_model(robot)
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:] = robot.default_qpos
        mujoco.mj_forward(self._model, self._data)

    @property
    def qpos(self) -> np.ndarray:
        """Root and joints."""
        return np.array(self._data.qpos)

    @property
    def qvel(self) -> np.ndarray:
        """Their velocities."""
        return np.array(self._data.qvel)

    @property
    def torque(self) -> np.ndarray:
        """Of the motors, at the last physics step [N m]."""
        return np.array(self._data.ctrl)

    def step(self, kp: np.ndarray, kd: np.ndarray, target: np.ndarray) -> None:
        """One state period on."""
        d = self._data
        for _ in range(_SUBSTEPS):
            d.ctrl[:] = np.clip(kp * (target - d.qpos[7:]) - kd * d.qvel[6:], -self._effort, self._effort)
            self._mujoco.mj_step(self._model, d)


def _torque_model(robot: RobotModel) -> mujoco.MjModel:
    """The robot, self-collision and all, with torque motors in place of its servos."""
    import copy

    model = copy.copy(robot.model)
    model.opt.timestep = STATE_DT / _SUBSTEPS
    model.actuator_gainprm[:, 0], model.actuator_biasprm[:, 1:3] = 1.0, 0.0
    return model


def sensed(body: SimulatedBody, rng: np.random.Generator) -> State:
    """What the sensors of a body tell, with their noise; motors warm, battery charged."""
    noise, qpos, qvel = SensorNoise(), body.qpos, body.qvel
    joints = len(qpos) - 7

    def draw(width: float, size: int) -> np.ndarray:
        return width * rng.uniform(-1.0, 1.0, size=size)

    return State(
        quat=rot.multiply(qpos[3:7], rot.exp(draw(noise.orientation, 3))),
        gyro=qvel[3:6] + draw(noise.gyro, 3),
        joint_pos=qpos[7:] + draw(noise.joint_pos, joints),
        joint_vel=qvel[6:] + draw(noise.joint_vel, joints),
        received=time.monotonic(),
        torque=body.torque,
        temperature=np.full(joints, _WARM),
        voltage=np.full(joints, _CHARGED),
    )


@contextlib.contextmanager
def rehearsal_robot(at: Path, tag: str, fault: RehearsedFault | None = None) -> Iterator[Event]:
    """The simulated robot's process, for as long as the block lasts; the event tells that it has begun to speak."""
    fresh = multiprocessing.get_context("spawn")
    stop, ready = fresh.Event(), fresh.Event()
    process = fresh.Process(target=run_robot, args=("g1", at, stop, ready, tag, fault), daemon=True)
    process.start()
    try:
        yield ready
    finally:
        stop.set()
        process.join(10.0)
        process.kill()
