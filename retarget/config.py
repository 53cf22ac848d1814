"""Every number of the retargeting stage, with its unit. Defaults stand here and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from retarget.errors import RetargetError


@dataclass(frozen=True, kw_only=True)
class ContactConfig:
    """When a foot edge counts as touching, on the source's own points.

    A touch lasts while the loose pair holds, and must hold the tight pair for the shortest duration within. The report
    has a fixed rule of its own, so that these numbers cannot flatter it.
    """

    tight_speed: float = 0.25  # [m/s]
    loose_speed: float = 0.40  # [m/s]
    tight_height: float = 0.04  # over the point's own floor [m]
    loose_height: float = 0.06  # [m]
    floor_percentile: float = 5.0  # of the point's height: its own floor
    min_duration_s: float = 0.06  # a shorter touch is noise, a shorter gap is no step [s]
    pivot_rate: float = 1.5  # foot yaw rate above which a touching foot turns on purpose [rad/s]


@dataclass(frozen=True, kw_only=True)
class GoalWeights:
    """How firmly each goal is held: per metre for positions and limb vectors, per radian for orientations."""

    pelvis_position: float = 10.0
    pelvis_orientation: float = 3.0
    torso_orientation: float = 3.0
    leg: float = 15.0  # thigh and shin
    arm: float = 19.0  # upper arm and forearm
    planted: float = 410.0  # heel and toe edges while they touch
    pivot: float = 40.0  # across the floor, while they turn on purpose
    swing: float = 12.0  # in the air: the legs' directions matter more than the exact path
    planted_roll: float = 20.0  # of a touching foot about its length
    swing_roll: float = 1.0
    posture: float = 0.15  # towards the default pose, or the recording of this very robot
    free_joint: float = 0.7  # the same, of joints that only turn a hand or the head
    pin: float = 100.0  # of a joint at a key frame


@dataclass(frozen=True, kw_only=True)
class Level:
    """One grid of the whole-clip solver, coarse to fine."""

    step_s: float  # between its frames [s]; never finer than the clip's own
    iterations: int  # of Gauss-Newton
    smooth_hz: float  # half-power frequency of its smoothness [Hz]
    more_iterations: int = 0  # of the stretches that still move
    rounds: int = 3  # of the active set, per iteration
    clearance: bool = True  # of soles and bodies


@dataclass(frozen=True, kw_only=True)
class WholeClipConfig:
    """The whole-clip solver."""

    rough: Level = Level(  # before the leads are known
        step_s=0.2, iterations=5, more_iterations=8, smooth_hz=2.0, rounds=2, clearance=False
    )
    fine: tuple[Level, ...] = (
        Level(step_s=0.06, iterations=2, more_iterations=2, rounds=2, smooth_hz=3.22),
        Level(step_s=0.0, iterations=0, more_iterations=24, rounds=2, smooth_hz=3.22),
    )
    travel_hz: float = 1.7  # half-power frequency of the root's way over the floor [Hz]: a robot cannot push it faster
    height_hz: float = 2.5  # of its height [Hz]
    settled: float = 0.05  # a last step below this is no movement [rad or m]
    settle_margin_s: float = 0.1  # solved again on either side [s]
    damping: float = 0.01  # of the first iteration, as a share of the goals' curvature
    rough_damping: float = 1.0  # the same where the start is far away
    largest_turn: float = 0.3  # of any joint in one iteration [rad]
    rough_turn: float = 0.6  # the same where the start is far away
    limit_margin: float = 0.01  # kept from each joint limit [rad]
    speed_share: float = 0.95  # of each motor's speed limit, per output frame
    acceleration_share: float = 0.98  # of each motor's acceleration limit
    body_gap: float = 0.015  # kept between bodies: a robot follows to about a centimetre [m]
    body_spring: float = 100.0  # per metre: soft, for many frames share the work
    floor_gap: float = 0.0005  # kept between soles or bodies and the floor [m]
    floor_spring: float = 1200.0
    window_s: float = 40.0  # longer clips are solved in windows of this length [s]
    overlap_s: float = 2.0  # shared by neighbouring windows and blended [s]


@dataclass(frozen=True, kw_only=True)
class IkConfig:
    """The per-frame back ends."""

    iterations: int = 4  # per frame, warm-started
    first_iterations: int = 80  # so that frame 0 is converged
    damping: float = 1e-3
    limit_margin: float = 0.01  # kept from each joint limit [rad]
    speed_share: float = 0.95  # of each motor's speed limit, per output frame
    pelvis_position: float = 10.0  # weights as in GoalWeights
    pelvis_orientation: float = 3.0
    torso_orientation: float = 3.0
    planted: float = 20.0  # weight of a touching foot, per metre
    planted_turn: float = 3.0
    swing: float = 5.0
    swing_turn: float = 0.5
    leg: float = 3.0  # lower than there, for here nothing but these hold a frame to the last
    arm: float = 4.0
    posture: float = 0.06


@dataclass(frozen=True, kw_only=True)
class Gates:
    """What a reference has to keep to be called feasible."""

    penetration_mm: float = 5.0  # deepest point under the floor
    slide_mm: float = 30.0  # worst slide of one touch of a foot edge
    self_collision_mm: float = 10.0  # deepest overlap of two bodies
    joint_limit_rad: float = 1e-6  # beyond a position limit
    speed_share: float = 1.0  # of the motors' speed limits, frame to frame
    acceleration_share: float = 1.0  # of what the motors can do against the default pose's inertia, frame to frame
    airborne_points: float = 6.0  # difference of the airborne share to the source's, percentage points
    hovering_frames: float = 5.0  # of lead-in and lead-out


@dataclass(frozen=True, kw_only=True)
class RetargetConfig:
    """From clip to reference."""

    solver: str = "whole-clip"  # or a per-frame one: "mink", "placo"
    fps: float = 50.0  # of the reference [frames/s]
    lead_in_s: float = 1.0  # stand -> first pose [s]
    lead_out_s: float = 1.0  # last pose -> stand [s]
    stand_s: float = 0.3  # standing still at both ends [s]
    reach: float = 0.985  # longest hip-ankle distance of a planted leg, of the leg's length
    contact: ContactConfig = field(default_factory=ContactConfig)
    weights: GoalWeights = field(default_factory=GoalWeights)
    whole_clip: WholeClipConfig = field(default_factory=WholeClipConfig)
    ik: IkConfig = field(default_factory=IkConfig)
    gates: Gates = field(default_factory=Gates)
    dynamics: bool = True  # report whether physics allows the motion

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, float) and not 0.0 <= value < 1e6:
                raise RetargetError(f"setting {f.name}", found=repr(value), expected="a number of at least 0")
        if not self.fps >= 5.0:
            raise RetargetError("setting fps", found=repr(self.fps), expected="at least 5 frames per second")
