"""The tracking task for N robots at once: reset somewhere in the reference, follow it, be rewarded, fail or finish."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import Reference
from robot_models import RobotModel, body_states
from robot_models import rotation as rot
from tracking.comparison import ReferenceTables, TrackingErrors, compare, failures
from tracking.config import TaskConfig
from tracking.observations import Situation, actor_table, critic_table
from tracking.physics import PhysicsBatch
from tracking.randomisation import make_models
from tracking.rewards import beyond_soft_limits, reward_terms


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
    """N robots following one reference.

    Actions are residuals: joint target = reference of the next frame + action_scale * effort / kp * action, so that
    zero action already asks for the dance.
    """

    robot: RobotModel
    reference: Reference
    envs: int
    config: TaskConfig = field(default_factory=TaskConfig)
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.dt = 1.0 / self.reference.fps
        self.tables = ReferenceTables(self.reference, self.robot)
        c = self.config
        physics_dt = self.dt / np.ceil(self.dt / c.physics_dt - 1e-9)
        models = make_models(self.robot, self.envs, physics_dt, c.randomisation, self.rng)
        self.physics = PhysicsBatch(models, control_dt=self.dt, threads=self.threads)
        self.action_scale = c.action_scale * self.robot.effort / self.robot.kp
        self.actor = actor_table(self.robot, self.tables, c.observation_noise, c.look_ahead)
        self.critic = critic_table(self.robot, self.tables, c.look_ahead)
        joints = len(self.robot.joint_names)
        bias = c.randomisation.encoder_bias if c.randomisation.enabled else 0.0
        self.encoder_bias = self.rng.uniform(-bias, bias, size=(self.envs, joints))
        self.frame = np.zeros(self.envs, dtype=int)
        self.last_action = np.zeros((self.envs, joints))
        self.heading = np.tile(rot.IDENTITY, (self.envs, 1))
        self.states = body_states(self.robot, np.tile(self.robot.default_qpos, (self.envs, 1)), self.physics.qvel)
        self.reset(np.arange(self.envs))

    @property
    def actions(self) -> int:
        """Numbers in one action: one per joint."""
        return len(self.robot.joint_names)

    def reset(self, ids: Int[ndarray, "n"], start: Int[ndarray, "n"] | None = None) -> None:
        """Put robots into the reference, disturbed by the start noise.

        Args:
            ids: which robots.
            start: frames to start at; by default uniform over all but the last half second.
        """
        if start is None:
            latest = max(1, self.tables.frames - 1 - round(0.5 / self.dt))
            start = self.rng.integers(0, latest, size=len(ids))
        qpos, qvel = self._disturbed(start)
        self.physics.set(ids, qpos, qvel)
        self.frame[ids] = start
        self.last_action[ids] = 0.0
        turned = rot.multiply(qpos[:, 3:7], rot.conjugate(self.tables.qpos[start, 3:7]))
        self.heading[ids] = rot.from_yaw(rot.yaw(turned))
        fresh = body_states(self.robot, qpos, qvel)
        for name in ("pos", "quat", "lin_vel", "ang_vel"):
            getattr(self.states, name)[ids] = getattr(fresh, name)

    def step(self, action: Float[ndarray, "N J"]) -> StepResult:
        """One control period towards the next frame of the reference."""
        following = np.minimum(self.frame + 1, self.tables.frames - 1)
        targets = self.tables.joint_pos[following] + self.action_scale * action
        self.physics.step(np.clip(targets, self.robot.lower, self.robot.upper) - self.encoder_bias)
        self.frame = following
        diverged = np.asarray(~np.isfinite(self.physics.state).all(axis=1))
        if diverged.any():
            # Back onto the reference at once: a state that is no number would spoil observations and rewards too.
            self.physics.set(diverged, self.tables.qpos[self.frame[diverged]], self.tables.qvel[self.frame[diverged]])
        self.states = body_states(self.robot, self.physics.qpos, self.physics.qvel)
        errors = compare(self.states, self.tables, self.frame)
        over = beyond_soft_limits(
            self.physics.qpos[:, 7:], self.robot.lower, self.robot.upper, self.config.rewards.soft_limit
        )
        terms = reward_terms(errors, action, self.last_action, over, self.config.rewards)
        causes = failures(errors, self.tables, self.config.terminations)
        causes["diverged"] = diverged
        terminated = np.any(list(causes.values()), axis=0)
        self.last_action = np.array(action)
        # Scaled by dt, so that returns are in reward-seconds and do not grow with the control rate.
        reward = np.sum(list(terms.values()), axis=0) * self.dt
        return StepResult(
            reward=reward,
            terminated=terminated,
            truncated=(self.frame >= self.tables.frames - 1) & ~terminated,
            terms=terms,
            causes=causes,
            errors=errors,
        )

    def observe(self, *, noisy: bool = True) -> tuple[Float[ndarray, "N A"], Float[ndarray, "N C"]]:
        """Observations of actor (with noise) and critic (without), both of the present state."""
        s = self.situation()
        return self.actor.observe(s, self.rng if noisy else None), self.critic.observe(s, None)

    def situation(self) -> Situation:
        """The present instant: sensors are read from the same state as the bodies."""
        qpos, qvel = self.physics.qpos, self.physics.qvel
        return Situation(
            qpos=qpos,
            qvel=qvel,
            states=self.states,
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
            "frame": self.frame.copy(),
            "last_action": self.last_action.copy(),
            "heading": self.heading.copy(),
            "rng": self.rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from a saved state; models and encoder biases follow from the seed."""
        self.physics.state[:] = state["physics"]
        self.frame, self.last_action = state["frame"].copy(), state["last_action"].copy()
        self.heading = state["heading"].copy()
        self.rng.bit_generator.state = state["rng"]
        self.states = body_states(self.robot, self.physics.qpos, self.physics.qvel)
