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
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robot_models import RobotModel, load_robot
from robot_models.maths import rotation as rot
from tracking.config import ObservationNoise

if TYPE_CHECKING:
    import mujoco

STATE_DT = 0.002  # between two states: 500 Hz [s]
_SUBSTEPS = 2  # physics steps in between
_SILENCE = 0.2  # without a new command, then damping [s]


@dataclass(frozen=True, kw_only=True)
class SensorNoise:
    """Half widths of uniform noise: a tenth of what policies are trained with, for gyro and velocities a fifth."""

    orientation: float = 0.1 * ObservationNoise.orientation  # [rad]
    gyro: float = 0.2 * ObservationNoise.gyro  # [rad/s]
    joint_pos: float = 0.1 * ObservationNoise.joint_position  # [rad]
    joint_vel: float = 0.2 * ObservationNoise.joint_velocity  # [rad/s]


def run_robot(robot_name: str, log: Path, stop: Event, seed: int = 0) -> None:
    """Be the robot until told to stop; then write what happened to `log`.npz, and what the SDK said to `log`.txt."""
    from tracking.deploy.transport import RobotTransport

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the controller's to answer
    with open(log.with_suffix(".txt"), "wb") as talk:
        os.dup2(talk.fileno(), 1)
    robot, transport, rng = load_robot(robot_name), RobotTransport(), np.random.default_rng(seed)
    body = _Body(robot)
    path, times, ages = [body.qpos], [time.monotonic()], []
    pulse, changed, hanging = 0.0, time.monotonic(), True
    due, step = time.monotonic(), 0
    while not stop.is_set():
        (command, beat), now = transport.command(), time.monotonic()
        if beat != pulse:
            pulse, changed = beat, now
        hanging = hanging and not command.kp.any()
        if not hanging:
            quiet = now - changed > _SILENCE
            body.step(np.zeros_like(command.kp) if quiet else command.kp, command.kd, command.target)
            ages.append(now - changed)
        transport.publish(*_sensors(body, rng))
        step += 1
        if step % 10 == 0:
            path.append(body.qpos)
            times.append(now)
        due += STATE_DT
        time.sleep(max(0.0, due - time.monotonic()))
        if time.monotonic() - due > 0.5:  # the machine stood still: time goes on from here
            due = time.monotonic()
    np.savez(log.with_suffix(".npz"), qpos=np.array(path), time=np.array(times), age=np.array(ages))


class _Body:
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


def _sensors(body: _Body, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    noise, qpos, qvel = SensorNoise(), body.qpos, body.qvel
    joints = len(qpos) - 7

    def draw(width: float, size: int) -> np.ndarray:
        return width * rng.uniform(-1.0, 1.0, size=size)

    return (
        rot.multiply(qpos[3:7], rot.exp(draw(noise.orientation, 3))),
        qvel[3:6] + draw(noise.gyro, 3),
        qpos[7:] + draw(noise.joint_pos, joints),
        qvel[6:] + draw(noise.joint_vel, joints),
    )


@contextlib.contextmanager
def rehearsal_robot(at: Path) -> Iterator[None]:
    """The simulated robot's process, for as long as the block lasts."""
    fresh = multiprocessing.get_context("spawn")
    stop = fresh.Event()
    process = fresh.Process(target=run_robot, args=("g1", at, stop), daemon=True)
    process.start()
    try:
        yield
    finally:
        stop.set()
        process.join(10.0)
        process.kill()
