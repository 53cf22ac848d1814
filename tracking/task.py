"""The tracking task for N robots at once: reset somewhere in the reference, follow it, be rewarded, fail or finish."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import Reference
from robot_models import RobotModel
from robot_models import rotation as rot
from tracking.body_sensors import BodySensors
from tracking.comparison import ReferenceTables, TrackingErrors, compare, failures
from tracking.config import TaskConfig
from tracking.mujoco_batch import MujocoBatch
from tracking.observations import Situation, actor_table, privileged_table
from tracking.physics import Engine
from tracking.prior import joint_targets
from tracking.randomisation import Pushes, draw_robots
from tracking.rewards import beyond_soft_limits, reward_terms
from tracking.runner import Measurement
from tracking.starts import Starts


@dataclass(frozen=True, kw_only=True, eq=False)
class StepResult:
    """What one control step led to. Terminated: failed. Truncated: the clip ran out. They stay two things."""

    reward: Float[ndarray, "N"]
    terminated: Bool[ndarray, "N"]
    truncated: Bool[ndarray, "N"]
    terms: dict[str, Float[ndarray, "N"]]
    causes: dict[str, Bool[ndarray, "N"]]
    errors: TrackingErrors


@dataclass(kw_only=True, eq=False)
class TrackingTask:
    """N robots following one reference, or each one of several.

    Actions are residuals: servo target = `joint_targets` of the next frame + action_scale * effort / kp * action, so
    that zero action already asks for the dance, with the torques that it needs.
    """

    robot: RobotModel
    reference: Reference | Sequence[Reference]
    envs: int
    config: TaskConfig = field(default_factory=TaskConfig)
    seed: int = 0
    threads: int = 0
    engine: Engine = MujocoBatch
    weights: Sequence[float] = ()  # of the references; all alike by default

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        references = (self.reference,) if isinstance(self.reference, Reference) else tuple(self.reference)
        self.dt = 1.0 / references[0].fps
        self.tables = ReferenceTables(references, self.robot)
        self.targets = np.concatenate([joint_targets(r, self.robot) for r in references])
        # A motor pushes with all it has at this distance; further targets would only wind up.
        reach = self.robot.effort / self.robot.kp
        self.target_range = self.robot.lower - reach, self.robot.upper + reach
        c = self.config
        physics_dt = self.dt / np.ceil(self.dt / c.physics_dt - 1e-9)
        drawn = draw_robots(self.robot, self.envs, physics_dt, c.randomisation, self.rng)
        self.encoder_bias = drawn.encoder_bias
        self.delay = drawn.delay
        self.physics = self.engine(drawn.models, control_dt=self.dt, delay=drawn.delay, threads=self.threads)
        self.pushes = Pushes(self.envs, self.dt, c.randomisation, self.rng)
        self.action_scale = c.action_scale * self.robot.effort / self.robot.kp
        self.starts = Starts(self.tables, self.dt, c.starts, self.weights or [1.0] * len(references))
        self.actor = actor_table(self.robot, self.tables, c.observation_noise, c.look_ahead, c.look_back)
        self.privileged = privileged_table(self.tables)
        self.frame = np.zeros(self.envs, dtype=int)
        self.last_action = np.zeros((self.envs, self.actions))
        # States at the ends of the last control periods, the present one first.
        self.past = np.zeros((1 + max(c.look_back, default=0), *self.physics.state.shape))
        self.heading = np.tile(rot.IDENTITY, (self.envs, 1))
        self.sensors = BodySensors(self.robot, self.tables.bodies, self.envs, self.threads)
        self.reset(np.arange(self.envs))

    @property
    def actions(self) -> int:
        """Numbers in one action: one per joint."""
        return len(self.robot.joint_names)

    def reset(self, ids: Int[ndarray, "n"], start: Int[ndarray, "n"] | None = None) -> None:
        """Put robots into the reference, disturbed by the start noise.

        Args:
            ids: which robots.
            start: frames to start at; by default where practice is needed.
        """
        if start is None:
            start = self.starts.draw(len(ids), self.rng)
        qpos, qvel = self._disturbed(start)
        self.physics.set(ids, qpos, qvel, self.targets[start])
        self.past[:, ids] = self.physics.state[ids]
        self.frame[ids] = start
        self.last_action[ids] = 0.0
        turned = rot.multiply(qpos[:, 3:7], rot.conjugate(self.tables.qpos[start, 3:7]))
        self.heading[ids] = rot.from_yaw(rot.yaw(turned))
        self.sensors.read_some(ids, self.physics.state[ids])

    def step(self, action: Float[ndarray, "N J"], targets: Float[ndarray, "N J"] | None = None) -> StepResult:
        """One control period towards the next frame of the reference.

        Args:
            action: of the policy.
            targets: of the servos [rad], where someone else has made them from the action.
        """
        following = self.tables.ahead(self.frame, 1)
        self.pushes.apply(self.physics.qvel, self.rng)
        if targets is None:
            targets = np.clip(self.targets[following] + self.action_scale * action, *self.target_range)
        self.physics.step(targets - self.encoder_bias)
        self.frame = following
        diverged = np.asarray(~np.isfinite(self.physics.state).all(axis=1))
        if diverged.any():
            # Back onto the reference at once: a state that is no number would spoil observations and rewards too.
            at = self.frame[diverged]
            self.physics.set(diverged, self.tables.qpos[at], self.tables.qvel[at], self.targets[at])
        self.past[1:] = self.past[:-1]
        self.past[0] = self.physics.state
        self.sensors.read(self.physics.state)
        errors = compare(self.sensors.states, self.tables, self.frame)
        over = beyond_soft_limits(
            self.physics.qpos[:, 7:], self.robot.lower, self.robot.upper, self.config.rewards.soft_limit
        )
        terms = reward_terms(errors, action, self.last_action, over, self.config.rewards)
        causes = failures(errors, self.tables, self.config.terminations)
        causes["diverged"] = diverged
        terminated = np.any(list(causes.values()), axis=0)
        self.starts.fell(self.frame[terminated])
        self.last_action = np.array(action)
        # Scaled by dt, so that returns are in reward-seconds and do not grow with the control rate.
        reward = np.sum(list(terms.values()), axis=0) * self.dt
        return StepResult(
            reward=reward,
            terminated=terminated,
            truncated=(self.frame >= self.tables.last[self.frame]) & ~terminated,
            terms=terms,
            causes=causes,
            errors=errors,
        )

    def harden(self, progress: float) -> None:
        """Set delays and pushes to what they shall be at this share of the training budget."""
        draw = self.config.randomisation
        part = min(1.0, progress / draw.grow_over) if draw.grow_over > 0.0 else 1.0
        self.physics.set_delay(part * self.delay)
        self.pushes.strength = part if draw.enabled and draw.pushes else 0.0

    def observe(self, *, noisy: bool = True) -> tuple[Float[ndarray, "N A"], Float[ndarray, "N C"]]:
        """Observations of actor (with noise) and critic (without), both of the present state."""
        s = self.situation()
        seen = self.actor.values(s)
        critic = np.concatenate((seen, self.privileged.values(s)), axis=1)
        return self.actor.disturbed(seen, self.rng) if noisy else seen, critic

    def measured(self, *, noisy: bool = True) -> Measurement:
        """What the robots' sensors tell of the present state."""
        noise, share = self.config.observation_noise, 1.0 if noisy else 0.0
        qpos, qvel = self.physics.qpos, self.physics.qvel

        def draw(size: int, width: float) -> ndarray:
            return share * width * self.rng.uniform(-1.0, 1.0, size=(self.envs, size))

        return Measurement(
            quat=rot.multiply(qpos[:, 3:7], rot.exp(draw(3, noise.orientation))),
            gyro=qvel[:, 3:6] + draw(3, noise.gyro),
            joint_pos=qpos[:, 7:] + self.encoder_bias + draw(self.actions, noise.joint_position),
            joint_vel=qvel[:, 6:] + draw(self.actions, noise.joint_velocity),
            root_pos=qpos[:, :3],
            root_lin_vel=rot.rotate(rot.conjugate(qpos[:, 3:7]), qvel[:, :3]),
        )

    def close(self) -> None:
        """End the threads."""
        self.physics.close()
        self.sensors.close()

    def situation(self) -> Situation:
        """The present instant: sensors are read from the same state as the bodies."""
        return Situation(
            qpos=self.physics.qpos_of(self.past),
            qvel=self.physics.qvel_of(self.past),
            states=self.sensors.states,
            frame=self.frame,
            last_action=self.last_action,
            encoder_bias=self.encoder_bias,
            heading=self.heading,
        )

    def _disturbed(self, start: Int[ndarray, "n"]) -> tuple[ndarray, ndarray]:
        noise, count = self.config.start_noise, len(start)

        def draw(width: object, size: int) -> ndarray:
            return noise.scale * self.rng.uniform(-1.0, 1.0, size=(count, size)) * np.asarray(width)

        qpos, qvel = self.tables.qpos[start].copy(), self.tables.qvel[start].copy()
        qpos[:, :3] += draw(noise.position, 3)
        roll_pitch_yaw = draw(noise.orientation, 3)
        qpos[:, 3:7] = rot.normalise(rot.multiply(rot.from_euler(roll_pitch_yaw[:, ::-1], "ZYX"), qpos[:, 3:7]))
        qpos[:, 7:] += draw(noise.joint_position, self.actions)
        qpos[:, 7:] = np.clip(qpos[:, 7:], self.robot.lower, self.robot.upper)
        qvel[:, :3] += draw(noise.linear_velocity, 3)
        qvel[:, 3:6] += draw(noise.angular_velocity, 3)
        return qpos, qvel

    def state_dict(self) -> dict[str, Any]:
        """Everything that a resumed run needs to go on bit for bit."""
        return {
            "physics": self.physics.state.copy(),
            "commands": self.physics.targets.copy(),
            "past": self.past.copy(),
            "pushes": self.pushes.wait.copy(),
            "failures": self.starts.failures.copy(),
            "frame": self.frame.copy(),
            "last_action": self.last_action.copy(),
            "heading": self.heading.copy(),
            "rng": self.rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from a saved state; models and encoder biases follow from the seed."""
        self.physics.state[:], self.physics.targets[:] = state["physics"], state["commands"]
        self.past[:], self.pushes.wait[:] = state["past"], state["pushes"]
        self.starts.failures = state["failures"].copy()
        self.frame, self.last_action = state["frame"].copy(), state["last_action"].copy()
        self.heading = state["heading"].copy()
        self.rng.bit_generator.state = state["rng"]
        self.sensors.read(self.physics.state)
