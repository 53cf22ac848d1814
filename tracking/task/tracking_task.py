"""The tracking task for N robots at once: reset somewhere in the reference, follow it, be rewarded, fail or finish."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from operator import or_
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from clips import Reference
from robot_models import RobotModel
from robot_models.maths import Array, array_namespace, push_history, to_numpy
from robot_models.maths import rotation as rot
from tracking.config import TaskConfig
from tracking.engines import Engine, MujocoBatch
from tracking.errors import TrackingError
from tracking.policy import Measurement, joint_targets, target_range
from tracking.task.motion_set import is_floor_work
from tracking.task.observations import ObservationTable, TaskState, actor_table, privileged_table, teacher_table
from tracking.task.randomisation import Pushes, draw_robots
from tracking.task.resets import FocusedSampler, ResetSampler
from tracking.task.rewards import beyond_soft_limits, reward_terms
from tracking.task.tracking_errors import ReferenceTables, TrackingErrors, compare, failures


@dataclass(frozen=True, kw_only=True, eq=False)
class StepResult:
    """What one control step led to. Terminated: failed. Truncated: the clip ran out. They stay two things."""

    reward: Float[Array, "N"]
    terminated: Bool[Array, "N"]
    truncated: Bool[Array, "N"]
    terms: dict[str, Float[Array, "N"]]
    causes: dict[str, Bool[Array, "N"]]
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
    focus: int = 0  # so many of the references come first: a share of the episodes is theirs

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        references = (self.reference,) if isinstance(self.reference, Reference) else tuple(self.reference)
        self.dt = 1.0 / references[0].fps
        rates = sorted({r.fps for r in references})
        if len(rates) > 1:
            raise TrackingError(
                "references",
                found=f"{' and '.join(f'{r:g}' for r in rates)} frames per second",
                expected="one rate for all",
            )
        c, robot = self.config, self.robot
        physics_dt = self.dt / np.ceil(self.dt / c.physics_dt - 1e-9)
        on_floor = any(is_floor_work(r, robot) for r in references)
        drawn = draw_robots(robot, self.envs, physics_dt, c.randomisation, rng, floor_work=on_floor)
        self.physics = self.engine(drawn.models, control_dt=self.dt, delay=drawn.delay, threads=self.threads)
        # From here on everything is where the engine computes.
        to_device, self.rng = self.physics.to_device, self.physics.make_rng(rng)
        tables = ReferenceTables(references, robot)
        self.tables = tables.on(to_device)
        self.targets = to_device(np.concatenate([joint_targets(r, robot) for r in references]))
        lower, upper = target_range(robot, robot.lower, robot.upper)
        self.target_range = to_device(lower), to_device(upper)
        self.joint_range = to_device(robot.lower), to_device(robot.upper)
        self.action_scale = to_device(c.action_scale * robot.effort / robot.kp)
        self.encoder_bias, self.delay, self.imu = (to_device(x) for x in (drawn.encoder_bias, drawn.delay, drawn.imu))
        self.pushes = Pushes(self.envs, self.dt, c.randomisation, self.rng, to_device)
        weights = self.weights or [1.0] * len(references)
        self.starts = (
            FocusedSampler(tables, self.dt, c.starts, self.focus, to_device)
            if self.focus
            else ResetSampler(tables, self.dt, c.starts, weights, to_device)
        )
        self.actor = actor_table(
            robot, self.tables, c.observation_noise, c.look_ahead, c.look_back, to_device, root_ahead=c.root_ahead
        )
        self.privileged = privileged_table(self.tables)
        self.frame = to_device(np.zeros(self.envs, dtype=int))
        self.last_action = to_device(np.zeros((self.envs, self.actions)))
        # States at the ends of the last control periods, the present one first.
        self.past = to_device(np.zeros((1 + max(c.look_back, default=0), *self.physics.state.shape)))
        self._straight = to_device(np.tile(rot.IDENTITY, (self.envs, 1)))
        self.heading = self._straight + 0.0
        self.sensors = self.physics.body_sensors(robot, self.tables.bodies, self.threads)
        noise, joints = c.start_noise, np.ones(self.actions)
        widths = (noise.position, noise.orientation, noise.joint_position * joints, noise.linear_velocity)
        self._disturbance = [to_device(noise.scale * np.array(w)) for w in (*widths, noise.angular_velocity)]
        self._start_noise = 1.0
        self.reset(to_device(np.arange(self.envs)))

    @cached_property
    def teacher(self) -> ObservationTable:
        """What a teacher sees; made when the first one looks."""
        return teacher_table(self.robot, self.tables, self.physics.to_device)

    @property
    def actions(self) -> int:
        """Numbers in one action: one per joint."""
        return len(self.robot.joint_names)

    def reset(self, ids: Int[Array, "n"], start: Int[Array, "n"] | None = None) -> None:
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
        told = rot.multiply(qpos[:, 3:7], self.imu[ids])
        turned = rot.multiply(told, rot.conjugate(self.tables.qpos[start, 3:7]))
        self.heading[ids] = rot.from_yaw(rot.yaw(turned))
        self.sensors.read_some(ids, self.physics.state[ids])

    def step(self, action: Float[Array, "N J"], targets: Float[Array, "N J"] | None = None) -> StepResult:
        """One control period towards the next frame of the reference.

        Args:
            action: of the policy.
            targets: of the servos [rad], where someone else has made them from the action.
        """
        following = self.tables.ahead(self.frame, 1)
        self.pushes.apply(self.physics.qvel, self.rng)
        xp = array_namespace(self.frame)
        if targets is None:
            targets = xp.clip(self.targets[following] + self.action_scale * action, *self.target_range)
        self.physics.step(targets - self.encoder_bias)
        self.frame = following
        diverged = ~xp.isfinite(self.physics.state).all(axis=1)
        if diverged.any():
            # Back onto the reference at once: a state that is no number would spoil observations and rewards too.
            at = self.frame[diverged]
            self.physics.set(diverged, self.tables.qpos[at], self.tables.qvel[at], self.targets[at])
        push_history(self.past, self.physics.state)
        self.sensors.read(self.physics.state)
        errors = compare(self.sensors.states, self.tables, self.frame)
        over = beyond_soft_limits(self.physics.qpos[:, 7:], *self.joint_range, self.config.rewards.soft_limit)
        terms = reward_terms(errors, action, self.last_action, over, self.config.rewards)
        causes = failures(errors, self.tables, self.config.terminations)
        causes["diverged"] = diverged
        terminated = reduce(or_, causes.values())
        self.starts.record(self.frame, self.frame[terminated])
        self.last_action = action + 0.0
        # Scaled by dt, so that returns are in reward-seconds and do not grow with the control rate.
        reward = sum(terms.values()) * self.dt
        return StepResult(
            reward=reward,
            terminated=terminated,
            truncated=(self.frame >= self.tables.last[self.frame]) & ~terminated,
            terms=terms,
            causes=causes,
            errors=errors,
        )

    def advance_curriculum(self, progress: float) -> None:
        """Set delays and pushes to what they shall be at this share of the training budget."""
        grow_over = self.config.randomisation.grow_over
        self.disturb(min(1.0, progress / grow_over) if grow_over > 0.0 else 1.0)

    def disturb(self, part: float, start_noise: float = 1.0) -> None:
        """Set delays and pushes to a part of what they are in full, and the noise of starts to another."""
        draw = self.config.randomisation
        self.physics.set_delay(part * self.delay)
        self.pushes.strength = part if draw.enabled and draw.pushes else 0.0
        self._start_noise = start_noise

    def observe(self, *, noisy: bool = True) -> tuple[Float[Array, "N A"], Float[Array, "N C"]]:
        """Observations of actor (with noise) and critic (without), both of the present state."""
        s = self.task_state()
        seen = self.actor.values(s)
        critic = array_namespace(seen).concat((seen, self.privileged.values(s)), axis=1)
        return self.actor.disturbed(seen, self.rng) if noisy else seen, critic

    def observe_all(self, *, noisy: bool = False) -> tuple[Float[Array, "N T"], Float[Array, "N 3"]]:
        """What a teacher sees of the present state, by sensors without a fault, and what its critic sees besides."""
        s = replace(self.task_state(), encoder_bias=0.0 * self.encoder_bias, imu=self._straight)
        seen = self.teacher.values(s)
        return self.teacher.disturbed(seen, self.rng) if noisy else seen, self.privileged.some(s, "anchor_position")

    def measured(self, *, noisy: bool = True, faulty: bool = True) -> Measurement:
        """What the robots' sensors tell of the present state.

        Args:
            noisy: with noise.
            faulty: with each robot's encoder bias and its IMU's mounting.
        """
        noise, share = self.config.observation_noise, 1.0 if noisy else 0.0
        qpos, qvel = self.physics.qpos, self.physics.qvel
        imu, bias = (self.imu, self.encoder_bias) if faulty else (self._straight, 0.0)

        def draw(size: int, width: float) -> Array:
            return share * width * self.rng.uniform(-1.0, 1.0, size=(self.envs, size))

        return Measurement(
            quat=rot.multiply(rot.multiply(qpos[:, 3:7], imu), rot.exp(draw(3, noise.orientation))),
            gyro=rot.rotate(rot.conjugate(imu), qvel[:, 3:6]) + draw(3, noise.gyro),
            joint_pos=qpos[:, 7:] + bias + draw(self.actions, noise.joint_position),
            joint_vel=qvel[:, 6:] + draw(self.actions, noise.joint_velocity),
            root_pos=qpos[:, :3],
            root_lin_vel=rot.rotate(rot.conjugate(qpos[:, 3:7]), qvel[:, :3]),
        )

    def close(self) -> None:
        """End the threads."""
        self.physics.close()
        self.sensors.close()

    def task_state(self) -> TaskState:
        """The present instant: sensors are read from the same state as the bodies."""
        return TaskState(
            qpos=self.physics.qpos_of(self.past),
            qvel=self.physics.qvel_of(self.past),
            states=self.sensors.states,
            frame=self.frame,
            last_action=self.last_action,
            encoder_bias=self.encoder_bias,
            imu=self.imu,
            heading=self.heading,
        )

    def _disturbed(self, start: Int[Array, "n"]) -> tuple[Array, Array]:
        def draw(width: Array) -> Array:
            return self._start_noise * width * self.rng.uniform(-1.0, 1.0, size=(len(start), len(width)))

        position, orientation, joints, linear, angular = map(draw, self._disturbance)
        qpos, qvel = self.tables.qpos[start], self.tables.qvel[start]  # copies
        qpos[:, :3] += position
        turn = rot.from_euler(array_namespace(qpos).flip(orientation, (1,)), "ZYX")  # drawn as roll, pitch, yaw
        qpos[:, 3:7] = rot.normalise(rot.multiply(turn, qpos[:, 3:7]))
        qpos[:, 7:] = array_namespace(qpos).clip(qpos[:, 7:] + joints, *self.joint_range)
        qvel[:, :3] += linear
        qvel[:, 3:6] += angular
        return qpos, qvel

    def state_dict(self) -> dict[str, Any]:
        """Everything that a resumed run needs to go on bit for bit."""
        kept = {
            "physics": self.physics.state,
            "commands": self.physics.targets,
            "past": self.past,
            "pushes": self.pushes.wait,
            **self.starts.state_dict(),
            "frame": self.frame,
            "last_action": self.last_action,
            "heading": self.heading,
        }
        return {name: to_numpy(value).copy() for name, value in kept.items()} | {"rng": self.rng.bit_generator.state}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from a saved state; models and encoder biases follow from the seed."""
        kept = {name: self.physics.to_device(value.copy()) for name, value in state.items() if name != "rng"}
        self.physics.state[:], self.physics.targets[:] = kept["physics"], kept["commands"]
        self.past[:], self.pushes.wait[:] = kept["past"], kept["pushes"]
        self.starts.load_state_dict(kept)
        self.frame, self.last_action, self.heading = kept["frame"], kept["last_action"], kept["heading"]
        self.rng.bit_generator.state = state["rng"]
        self.sensors.read(self.physics.state)
