"""Every number of the tracking task and its training, on one page. Defaults stand here and nowhere else.

Rewards, terminations, start noise, observation noise and randomisation ranges follow BeyondMimic (Liao et al. 2025)
as its public code has them, unless a comment says otherwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from tracking.errors import TrackingError


class _Checked:
    """Refuses numbers that no setting can have, in every group of settings by itself."""

    _signed: ClassVar[tuple[str, ...]] = ()  # fields that may be below zero

    def __post_init__(self) -> None:
        for f in fields(self):  # type: ignore[arg-type]
            value = getattr(self, f.name)
            numbers = [n for n in (value if isinstance(value, tuple) else (value,)) if isinstance(n, int | float)]
            low = -math.inf if f.name in self._signed else 0.0
            if not all(low <= n for n in numbers):  # NaN is not either
                raise TrackingError(f"setting {f.name}", found=repr(value), expected=f"at least {low:g}")
            if "range" in f.metadata and not numbers[0] <= numbers[1]:
                raise TrackingError(f"setting {f.name}", found=repr(value), expected="a range, the lower end first")


def _range(low: float, high: float) -> Any:
    """A field that is a range."""
    return field(default=(low, high), metadata={"range": True})


@dataclass(frozen=True, kw_only=True)
class RewardConfig(_Checked):
    """Weights, and widths sigma of exp(-error^2 / sigma^2)."""

    _signed = ("action_rate", "joint_limit")

    anchor_position: float = 0.5
    anchor_position_width: float = 0.3  # [m]
    anchor_orientation: float = 0.5
    anchor_orientation_width: float = 0.4  # [rad]
    body_position: float = 1.0
    body_position_width: float = 0.3  # [m]
    body_orientation: float = 1.0
    body_orientation_width: float = 0.4  # [rad]
    body_linear_velocity: float = 1.0
    body_linear_velocity_width: float = 1.0  # [m/s]
    body_angular_velocity: float = 1.0
    body_angular_velocity_width: float = 3.14  # [rad/s]
    action_rate: float = -0.1  # per squared change of the action
    joint_limit: float = -10.0  # per radian beyond the soft limits
    soft_limit: float = 0.9  # share of the joint range that costs nothing


@dataclass(frozen=True, kw_only=True)
class TerminationConfig(_Checked):
    """When a rollout has failed."""

    anchor_height: float = 0.25  # anchor off the reference's height [m]
    anchor_tilt: float = 0.8  # difference of the gravity direction's z in the anchor frames
    end_effector_height: float = 0.25  # feet and wrists off the reference's height [m]


@dataclass(frozen=True, kw_only=True)
class StartNoise(_Checked):
    """Half widths of the uniform disturbance of a start state."""

    position: tuple[float, float, float] = (0.05, 0.05, 0.01)  # [m]
    orientation: tuple[float, float, float] = (0.1, 0.1, 0.2)  # roll, pitch, yaw [rad]
    linear_velocity: tuple[float, float, float] = (0.5, 0.5, 0.2)  # [m/s]
    angular_velocity: tuple[float, float, float] = (0.52, 0.52, 0.78)  # [rad/s]
    joint_position: float = 0.1  # [rad]
    scale: float = 0.5  # of all of the above; the full width needs a policy that has learned to catch itself


@dataclass(frozen=True, kw_only=True)
class StartConfig(_Checked):
    """Where training episodes begin; what is left of the two shares begins anywhere."""

    opening: float = 0.1  # share that begins at the dance's first frame, as evaluations do
    failed: float = 0.5  # share that begins shortly before a frame where a robot failed
    before: float = 1.0  # how long before it, at most [s]
    focus: float = 0.6  # share of the references in focus, where there are some
    remembered: int = 1000  # failures
    # How much less or more often than by its length a reference of several is practised, by how often robots fail in it.
    favour: tuple[float, float] = _range(0.3, 3.0)


@dataclass(frozen=True, kw_only=True)
class ObservationNoise(_Checked):
    """Half widths of the uniform noise on what the actor sees."""

    orientation: float = 0.05  # on the anchor's six numbers
    gyro: float = 0.2  # [rad/s]
    joint_position: float = 0.01  # [rad]
    joint_velocity: float = 0.5  # [rad/s]


@dataclass(frozen=True, kw_only=True)
class RandomisationConfig(_Checked):
    """Ranges that each environment's own robot is drawn from."""

    enabled: bool = True
    friction: tuple[float, float] = _range(0.5, 1.2)  # of the soles
    mass: tuple[float, float] = _range(0.95, 1.05)  # factor on every body
    torso_com: float = 0.03  # half width, each axis [m]
    gains: tuple[float, float] = _range(0.95, 1.05)  # factor on kp and kd, per joint
    encoder_bias: float = 0.01  # half width [rad]
    imu_mounting: float = 0.02  # half width of the IMU's turn against where it should sit, about each axis [rad]
    # Motors lose torque with speed. In shares of the profile's speed limit, which is a motor's rated one: full torque up
    # to the knee, none from the no-load speed on. Unitree's four G1 motors: 0.70 to 0.83, and 1.08 to 1.14.
    torque_speed: bool = True
    knee: tuple[float, float] = _range(0.7, 0.85)
    no_load: tuple[float, float] = _range(1.05, 1.15)
    # From sensor to motor. All of it is counted on the way to the motor: to a policy, which acts on one instant, a
    # sensor that tells late and a motor that hears late are the same.
    delay: tuple[float, float] = _range(0.0, 0.02)  # [s]
    pushes: bool = True
    push_every: tuple[float, float] = _range(1.0, 3.0)  # [s]
    push_linear: tuple[float, float, float] = (0.25, 0.25, 0.1)  # half widths of a sudden change of the root's [m/s]
    push_angular: tuple[float, float, float] = (0.26, 0.26, 0.39)  # the same [rad/s]
    # A robot that cannot stand yet learns nothing from being pushed: delays and pushes grow from nothing to the above
    # over this share of the training budget. Evaluations have them in full.
    grow_over: float = 0.3


@dataclass(frozen=True, kw_only=True)
class TaskConfig(_Checked):
    """The tracking task."""

    physics_dt: float = 0.005  # longest physics step [s]; the control period is cut into equal ones
    action_scale: float = 0.5  # of effort / kp: radians of target per unit of action
    rewards: RewardConfig = field(default_factory=RewardConfig)
    terminations: TerminationConfig = field(default_factory=TerminationConfig)
    starts: StartConfig = field(default_factory=StartConfig)
    start_noise: StartNoise = field(default_factory=StartNoise)
    observation_noise: ObservationNoise = field(default_factory=ObservationNoise)
    randomisation: RandomisationConfig = field(default_factory=RandomisationConfig)
    look_ahead: tuple[int, ...] = (1, 5)  # reference frames that the actor is shown
    # Whether it is shown how the reference's root travels and how high it is there: what joint angles alone do not tell.
    root_ahead: bool = False
    # Earlier control periods whose measurements the actor is shown again. On g1 two of them slowed learning by a
    # quarter; with delays beyond one control period they should pay.
    look_back: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class PpoConfig(_Checked):
    """Proximal policy optimisation for small batches.

    The rate has to follow the divergence: a fixed 2e-3, best for the first half million steps on g1, kept that robot at
    3 s of the sample dance from one million on; 1e-4, where this rule took it from there, doubled that in 400k.
    """

    hidden: tuple[int, ...] = (256, 128)
    steps_per_env: int = 24
    epochs: int = 5
    minibatches: int = 4
    rate_range: tuple[float, float] = _range(2e-5, 2e-3)  # of the learning rate; a run begins with the highest
    # Divergence of the policy from itself before an update, which the rate shall bring about. Who knows nothing yet may
    # leap: it falls from the first value to the second over so many steps, and on to the last as more rollouts finish.
    first_kl: float = 0.3
    settled_kl: float = 0.06
    settle_steps: int = 1_000_000
    finishing_kl: float = 0.015
    gamma: float = 0.97  # two thirds of a second: how long a fall takes
    lam: float = 0.9
    # How the learning rate follows the divergence: by the ratio of wanted and found, within these factors per update.
    rate_steps: tuple[float, float] = _range(0.8, 1.25)
    initial_output: float = 0.1  # factor on the last layer's first weights: a run begins near the feed-forward
    clip: float = 0.2
    entropy: float = 0.003
    value_weight: float = 1.0
    max_grad_norm: float = 1.0
    initial_std: float = 0.3
    std_range: tuple[float, float] = _range(0.05, 1.0)
    episode_s: float = float("inf")  # longest episode of a training; beyond it returns are the critic's word [s]


@dataclass(frozen=True, kw_only=True)
class Ramp(_Checked):
    """A number that goes from one value to another while a training goes on, in equal factors."""

    first: float
    last: float
    until: float  # control steps
    since: float = 0.0

    def at(self, steps: float) -> float:
        """The value after so many control steps."""
        part = min(1.0, max(0.0, (steps - self.since) / max(1.0, self.until - self.since)))
        return float(self.first ** (1.0 - part) * self.last**part)


@dataclass(frozen=True, kw_only=True)
class TeacherConfig(_Checked):
    """A teacher: a network that sees everything, and learns to follow any reference of its robot.

    The sizes of updates follow this schedule whatever finishes: smaller than their noise in the end, since rollouts of
    hard dances end early for a long time (docs/training.md).
    """

    envs: int = 512
    critic_hidden: tuple[int, ...] = (256, 128)
    physics_dt: float = 0.01  # half the price of 5 ms; what is learnt at it stands as well at 5 ms [s]
    kl: Ramp = field(default_factory=lambda: Ramp(first=0.18, last=0.01, until=12e6))
    calm: Ramp = field(default_factory=lambda: Ramp(first=1.0, last=0.4, since=45e6, until=50e6))  # factor on that
    # A short horizon learns to follow sooner and stays there: falls begin a second before. From 39 M steps on, at which 0.97 and
    # 0.7 had long come to rest at 0.26 failures a second, 0.99 and 0.9 came to 0.21 within three million.
    gamma: Ramp = field(default_factory=lambda: Ramp(first=0.97, last=0.99, since=12e6, until=14e6))
    lam: Ramp = field(default_factory=lambda: Ramp(first=0.85, last=0.95, since=12e6, until=14e6))
    critic_rate: float = 1e-3  # of the critic's learning; the actor's follows the divergence
    std: Ramp = field(default_factory=lambda: Ramp(first=0.3, last=0.12, until=12e6))
    std_slack: float = 1.2  # largest factor between the actor's deviation and the schedule's
    entropy_until: float = 3e6  # control steps
    disturbed: tuple[float, float] = _range(4e6, 9e6)  # while start noise, delays and pushes grow from nothing
    ppo: PpoConfig = field(
        default_factory=lambda: PpoConfig(
            epochs=2, minibatches=4, episode_s=5.0, hidden=(512, 256), lam=0.85, rate_range=(4e-6, 2e-3)
        )
    )
    starts: StartConfig = field(default_factory=lambda: StartConfig(opening=0.1, failed=0.45))

    def disturbance(self, steps: float) -> float:
        """How much of the start noise, the delays and the pushes there is after so many control steps."""
        since, until = self.disturbed
        return min(1.0, max(0.0, (steps - since) / max(1.0, until - since)))


@dataclass(frozen=True, kw_only=True)
class FocusConfig(_Checked):
    """A teacher that goes on with its own optimisation, a new dance in most of its episodes."""

    kl: float = 0.03
    evaluate_every: int = 400_000  # control steps
    stands: float = 0.95  # share of two-second stands along the dance, and of its seconds, with which it is known
    patience: int = 5  # evaluations without a better one, after which there is nothing to wait for
    most_steps: int = 12_000_000
    share: float = 0.6  # of the minutes that a run may take


@dataclass(frozen=True, kw_only=True)
class DistillationConfig(_Checked):
    """What a pupil learns of a teacher (DAgger)."""

    samples: int = 0  # labels in all; 0: by the length of the dances
    per_second: int = 90_000  # labels for each second of them
    bounds: tuple[int, int] = _range(300_000, 6_000_000)  # of the labels in all
    evaluate_every: int = 100_000  # labels between evaluations, at least
    # The same, in control steps of one evaluation: it shall take a tenth of the time.
    evaluate_share: float = 5.0
    steps_per_env: int = 24  # control periods between two rounds of learning
    driving: tuple[float, float] = (1.0, 0.2)  # share of the episodes in which the teacher drives, first and last
    driving_until: float = 0.25  # share of the samples over which it falls
    episode_s: float = 5.0  # longest episode [s]
    batch: int = 1_024
    passes: float = 4.0  # over as many labels as are new
    rate: tuple[float, float] = _range(3e-5, 1e-3)  # of the learning rate, which falls from the higher to the lower
    rests: tuple[float, ...] = (0.125, 0.25, 0.5, 1.0)  # of the labels: it falls anew to each, for who began


@dataclass(frozen=True, kw_only=True)
class CheckConfig(_Checked):
    """The check of a reference before training, and what weighs it."""

    starts: int = 64  # along the dance
    limit_slack: float = 1e-6  # beyond a joint's range that counts as within it [rad]
    least_reward: float = 0.9  # of perfect tracking, of the largest, that makes a reference worth training on
    hard_share: float = 10.0  # per cent of impossible frames from which a dance is practised half as often


@dataclass(frozen=True, kw_only=True)
class TrainConfig(_Checked):
    """One training run. The budget is counted in steps, so that the same seed gives the same curve."""

    steps: int = 3_000_000  # control steps of all environments together; the schedules run over this budget
    minutes: float = float("inf")  # stop after this much wall time, whatever the steps [min]
    envs: int = 256
    seed: int = 0
    threads: int = 0  # 0: as many as the process may use
    engine: str = "mujoco"  # key of `engines.TRAINING`; evaluations are MuJoCo's
    fewest_rollouts: int = 10  # of each dance, where several share an evaluation
    evaluate_every: int = 200_000  # control steps between evaluations and checkpoints
    rollouts: int = 50  # per evaluation
    target: float = 0.97  # stop early when this share of rollouts finishes, twice in a row
    task: TaskConfig = field(default_factory=TaskConfig)
    ppo: PpoConfig = field(default_factory=PpoConfig)
    distillation: DistillationConfig = field(default_factory=DistillationConfig)
    focus: FocusConfig = field(default_factory=FocusConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("steps", "minutes", "envs", "evaluate_every", "rollouts", "fewest_rollouts"):
            if not getattr(self, name) > 0:
                raise TrackingError(f"setting {name}", found=repr(getattr(self, name)), expected="a number above 0")
