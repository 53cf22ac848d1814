"""The controller: damping, stand, heading aligned, lead-in, dance, lead-out, stand, damping; one tick at a time."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel
from tracking.deploy.guard import Guard
from tracking.deploy.messages import Command, State
from tracking.errors import TrackingError
from tracking.policy import Measurement, Motion, Runner


class Stage(Enum):
    """Where a performance stands."""

    DAMPING = "damping"  # before it begins: soft
    STAND = "stand"  # stiff servos: into the motion's first pose, and waiting there
    DANCE = "dance"  # the policy, lead-in and lead-out included
    OVER = "over"  # damping for good: done, stopped by a person, or by the guard


@dataclass(frozen=True, kw_only=True)
class StageConfig:
    """How long each stage takes."""

    damping_s: float = 1.0
    rise_s: float = 2.0  # into the first pose
    stand_s: float = 1.0  # in it
    loops: int = 1  # dances, a stand between them


class Controller:
    """From states to commands.

    Args:
        runner: the policy, started anew for every dance: its heading is the robot's of that moment.
        guard: everything passes it; damping and stand are its robot's own, not the policy's.
        config: times.

    Raises:
        TrackingError: a motion that does not begin and end on its feet: the stages before and after it stand.
    """

    def __init__(self, runner: Runner, guard: Guard, config: StageConfig | None = None) -> None:
        _check_ends(runner.motion, guard.limits.robot)
        self.runner, self.guard, self._config = runner, guard, config or StageConfig()
        self.stage, self.dances, self._ticks = Stage.DAMPING, 0, 0
        self._from: Float[ndarray, "J"] = np.zeros(0)

    def stop(self, reason: str) -> None:
        """Damping, for good; a person's stop key ends here."""
        self.guard.trip(reason)

    def tick(self, state: State, now: float, due: float) -> Command:
        """The command of this control period.

        Args:
            state: the newest.
            now: monotonic clock [s].
            due: when this tick was meant to be [s].
        """
        if self.stage is Stage.OVER or not self.guard.state(state, now, due, self._meant()):
            return self._over()
        self._ticks += 1
        command = self._command(state)
        return command if self.guard.command(command, state, now) else self._over()

    def _meant(self) -> Float[ndarray, "4"]:
        """The root's orientation that the motion asks for now; before and after a dance that of its first frame."""
        frame = self.runner.frame[0] if self.stage is Stage.DANCE else 0
        return self.runner.motion.root_quat[frame]

    def _command(self, state: State) -> Command:
        c, dt = self._config, self.runner.contract.control_dt
        passed = self._ticks * dt
        if self.stage is Stage.DAMPING:
            if passed < c.damping_s:
                return self.guard.limits.damping()
            self._enter(Stage.STAND, state)
        if self.stage is Stage.STAND:
            if passed < c.rise_s + c.stand_s or self._ticks == 0:
                return self._standing(min(1.0, self._ticks * dt / c.rise_s))
            if self.dances >= c.loops:
                return self._over()
            self._enter(Stage.DANCE, state)
            self.runner.start(_measured(state), 0)
        if self.runner.over:
            self.dances += 1
            self._enter(Stage.STAND, state)
            return self._standing(0.0)
        contract = self.runner.contract
        return Command(target=self.runner.act(_measured(state))[0], kp=contract.kp, kd=contract.kd)

    def _enter(self, stage: Stage, state: State) -> None:
        self.stage, self._ticks, self._from = stage, 0, state.joint_pos.copy()
        # Stiff and soft servos reach the same torque by different targets: their jump is no sign of anything wrong.
        self.guard.forget_target()

    def _standing(self, share: float) -> Command:
        limits = self.guard.limits
        target = (1.0 - share) * self._from + share * self.runner.motion.joint_pos[0]
        return Command(target=target, kp=limits.stand_kp, kd=limits.stand_kd)

    def _over(self) -> Command:
        self.stage = Stage.OVER
        return self.guard.limits.damping()


def _check_ends(motion: Motion, robot: RobotModel) -> None:
    ends = [0, -1]
    stands = robot.on_its_feet(motion.root_pos[ends], motion.root_quat[ends])
    if not stands.all():
        raise TrackingError(
            "motion", found=f"one that {'ends' if stands[0] else 'begins'} on the floor",
            expected="one that begins and ends on its feet: the robot is brought into its first pose, standing",
            cure="dance it in simulation: dance-eval, dance-play",
        )  # fmt: skip


def _measured(state: State) -> Measurement:
    return Measurement(
        quat=state.quat[None], gyro=state.gyro[None], joint_pos=state.joint_pos[None], joint_vel=state.joint_vel[None]
    )
