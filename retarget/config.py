"""Every number of the retargeting stage, with its unit. Defaults stand here and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass, field

from clips import ContactRule
from retarget.errors import RetargetError
from retarget.rules import Checked, Gates


@dataclass(frozen=True, kw_only=True)
class ContactConfig(Checked):
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

    @property
    def tight(self) -> ContactRule:
        """What a touch must hold for a while."""
        return ContactRule(height=self.tight_height, speed=self.tight_speed)

    @property
    def loose(self) -> ContactRule:
        """What it must hold all along."""
        return ContactRule(height=self.loose_height, speed=self.loose_speed)


@dataclass(frozen=True, kw_only=True)
class FeetConfig(Checked):
    """How feet are led between their stances, and kept off one another."""

    ramp_s: float = 0.12  # in which a foot leaves its flat pose towards the source's pitch [s]
    ease_s: float = 0.16  # in which a swinging foot takes up the source's motion [s]
    long_swing_s: float = 1.0  # beyond this a swing forgets its anchors on the way [s]
    sole_gap: float = 0.010  # kept between the soles of two standing feet [m]
    crossing_height: float = 0.12  # of one foot over the other, up to which they meet [m]
    separation_rounds: int = 10  # a stance that gives way to one may meet another
    ankle_margin: float = 0.02  # of the ankle's roll, kept for balance [rad]
    roll_cosine: float = 0.7  # to the foot's length, above which an ankle's joint is its roll
    follow_hz: float = 1.0  # how fast the body follows its feet where they were moved [Hz]
    straight_leg: float = 0.9995  # longest hip-ankle distance of a robot's own figure, of the leg's length


@dataclass(frozen=True, kw_only=True)
class JumpConfig(Checked):
    """When the source is in the air for certain."""

    height: float = 0.04  # of all edges over their own floor, for a moment [m]
    body: float = 0.15  # of everything else, all the while: who rocks on the seat with the feet up does not fly [m]
    longest_s: float = 0.7  # a person stays up no longer: beyond it the source hovers [s]


@dataclass(frozen=True, kw_only=True)
class PartsConfig(Checked):
    """When knees, hands, elbows, seat or shoulders are on the floor."""

    reach: float = 0.05  # over its lowest, from which a part is led to the floor [m]
    most_flesh: float = 1.5  # of a part's usual thickness, that is taken off a joint's height
    touching: float = 0.025  # over its lowest, under which it touches [m]
    still: float = 0.3  # of a part that stands; a faster one glides [m/s]
    gap_s: float = 0.1  # between two touches, that is one [s]


@dataclass(frozen=True, kw_only=True)
class ObjectiveWeights(Checked):
    """How firmly each goal is held: per metre for positions and limb vectors, per radian for orientations."""

    pelvis_position: float = 10.0
    pelvis_orientation: float = 3.0
    torso_orientation: float = 3.0
    leg: float = 15.0  # thigh and shin
    arm: float = 19.0  # upper arm and forearm
    planted: float = 410.0  # heel and toe edges while they touch
    pivot: float = 40.0  # across the floor, while they turn on purpose
    part: float = 100.0  # height of a knee, hand, elbow, seat or shoulder that is on the floor
    part_place: float = 15.0  # across the floor, of one that stands there
    swing: float = 12.0  # in the air: the legs' directions matter more than the exact path
    planted_roll: float = 20.0  # of a touching foot about its length
    swing_roll: float = 1.0
    posture: float = 0.15  # towards the default pose, or the recording of this very robot
    free_joint: float = 0.7  # the same, of joints that only turn a hand or the head
    hand: float = 2.0  # the same, of wrists that turn a hand as the person's
    pin: float = 100.0  # of a joint at a key frame


@dataclass(frozen=True, kw_only=True)
class GridStage(Checked):
    """One grid of the whole-clip solver, coarse to fine."""

    step_s: float  # between its frames [s]; never finer than the clip's own
    iterations: int  # of Gauss-Newton
    smooth_hz: float  # half-power frequency of its smoothness [Hz]
    more_iterations: int = 0  # of the stretches that still move
    rounds: int = 3  # of the active set, per iteration
    clearance: bool = True  # of soles and bodies


@dataclass(frozen=True, kw_only=True)
class GlideConfig(Checked):
    """When an edge carries although it moves."""

    carried: float = 0.3  # of the weight, that a body which does not fall free has under it
    height: float = 0.05  # of the edge over the floor, at most [m]
    level: float = 0.01  # over the lowest edge, up to which others carry with it [m]
    gap_s: float = 0.08  # between two glides, that is one [s]


@dataclass(frozen=True, kw_only=True)
class PhysicsConfig(Checked):
    """How a motion is bent until floor and motors can give what it needs; residuals are in the gates of `DynamicsConfig`."""

    weight: float = 3.0  # of a residual beside the goals; 0 leaves physics out
    most: float = 2.0  # a residual beyond it counts in proportion, not by its square
    least: float = 0.02  # a smaller one is none
    effort_share: float = 0.95  # of each motor's torque, that may be used
    joints: int = 3  # of a frame that are looked at, the worst
    settled: float = 0.5  # a frame with a lower score is left as it is
    margin_s: float = 0.2  # moved on either side of one that is not [s]
    stage: GridStage = GridStage(step_s=0.0, iterations=0, more_iterations=10, rounds=2, smooth_hz=3.22)
    floor_iterations: int = 10  # more of them, where more than feet comes to the floor


@dataclass(frozen=True, kw_only=True)
class WholeClipConfig(Checked):
    """The whole-clip solver."""

    coarse: GridStage = GridStage(  # before the leads are known
        step_s=0.2, iterations=5, more_iterations=8, smooth_hz=2.0, rounds=2, clearance=False
    )
    fine: tuple[GridStage, ...] = (
        GridStage(step_s=0.06, iterations=2, more_iterations=2, rounds=2, smooth_hz=3.22),
        GridStage(step_s=0.0, iterations=0, more_iterations=14, rounds=2, smooth_hz=3.22),
    )
    physics: PhysicsConfig = PhysicsConfig()
    floor_rounds: int = 5  # of the active set, where more than feet comes to the floor: much touches there at once
    travel_hz: float = 1.7  # half-power frequency of the root's way over the floor [Hz]: a robot cannot push it faster
    height_hz: float = 2.5  # of its height [Hz]
    settled: float = 0.05  # a last step below this is no movement [rad or m]
    at_rest: float = 0.005  # the same, of a frame beyond a joint limit [rad or m]
    settle_margin_s: float = 0.1  # solved again on either side [s]
    damping: float = 0.01  # of the first iteration, as a share of the goals' curvature
    coarse_damping: float = 1.0  # the same where the start is far away
    largest_turn: float = 0.3  # of any joint in one iteration [rad]
    coarse_turn: float = 0.6  # the same where the start is far away
    limit_margin: float = 0.01  # kept from each joint limit [rad]
    speed_share: float = 0.95  # of each motor's speed limit, per output frame
    acceleration_share: float = 0.98  # of each motor's acceleration limit
    body_gap: float = 0.015  # kept between bodies: a robot follows to about a centimetre [m]
    body_spring: float = 400.0  # per metre: firm, and still soft enough that many frames share the work
    floor_gap: float = 0.0005  # kept between soles or bodies and the floor [m]
    floor_spring: float = 1200.0
    parted_damping: float = 3.0  # at least, of frames whose bodies were in one another
    watched_gap: float = 0.04  # surfaces nearer than this are watched [m]
    held_slack: float = 0.0005  # what is so far beyond its gap is still taken for held, at first [m]
    caught: float = 0.004  # deeper in one another than this, bodies are led another way round [m]
    passage_s: float = 1.0  # on either side of them, that is solved again [s]
    reaches_s: tuple[float, ...] = (0.1, 0.25, 0.5)  # on either side, over which the other way begins straight [s]
    feet_off: float = 1.0  # squared weighted residual of the feet beyond which a frame is solved again
    pin_off: float = 0.005  # of a joint from its key frame, the same [rad]
    failed_ratio: float = 2.0  # a step whose frame comes out so many times worse than predicted, and
    failed_residual: float = 1.0  # so much, is taken back
    # Trust: where the goals fell short of the prediction by this share of it and this much, damping grows by the factor,
    # from the floor at least; elsewhere it shrinks.
    poor_share: float = 0.25
    poor_residual: float = 3e-3
    damping_growth: float = 4.0
    damping_floor: float = 0.03
    damping_decay: float = 3.0
    damping_range: tuple[float, float] = (1e-4, 100.0)
    # Springs that hold limits of order 0, 1 and 2: violations are forces over these. Stiffer ones make the active sets of
    # speed and acceleration cycle where joints have little room.
    limit_springs: tuple[float, float, float] = (1e6, 1e5, 3e4)
    limit_slack: float = 1e-3  # of a limit's width, that a step may be beyond it
    limit_rounds: int = 20  # of the active set, where a motion is projected into the limits
    projection_smoothness: tuple[float, ...] = (0.0, 0.5, 0.9, 0.99, 0.999, 0.9999)  # tried one after another
    window_s: float = 40.0  # longer clips are solved in windows of this length [s]
    overlap_s: float = 2.0  # shared by neighbouring windows and blended [s]


@dataclass(frozen=True, kw_only=True)
class IkConfig(Checked):
    """The per-frame back ends."""

    iterations: int = 4  # per frame, warm-started
    first_iterations: int = 80  # so that frame 0 is converged
    damping: float = 1e-3
    limit_margin: float = 0.01  # kept from each joint limit [rad]
    speed_share: float = 0.95  # of each motor's speed limit, per output frame
    pelvis_position: float = 10.0  # weights as in ObjectiveWeights
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
class SequenceConfig(Checked):
    """From one dance into the next."""

    transition_s: float = 1.0  # longer where the motors need it [s]
    lift: float = 0.05  # of a foot that steps across [m]
    near: float = 0.01  # a foot nearer to its next place than this stays down [m]
    steps: tuple[float, ...] = (0.08, 0.5, 0.92)  # of the bridge's time: the one foot moves, then the other


@dataclass(frozen=True, kw_only=True)
class RetargetConfig(Checked):
    """From clip to reference."""

    solver: str = "whole-clip"  # or a per-frame one: "mink", "placo"
    fps: float = 50.0  # of the reference [frames/s]
    lead_in_s: float = 1.0  # stand -> first pose [s]
    lead_out_s: float = 1.0  # last pose -> stand [s]
    stand_s: float = 0.3  # standing still at both ends [s]
    reach: float = 0.985  # longest hip-ankle distance of a planted leg, of the leg's length
    contact: ContactConfig = field(default_factory=ContactConfig)
    feet: FeetConfig = field(default_factory=FeetConfig)
    glides: GlideConfig = field(default_factory=GlideConfig)
    jumps: JumpConfig = field(default_factory=JumpConfig)
    parts: PartsConfig = field(default_factory=PartsConfig)
    dynamics: bool = True  # report whether physics allows the motion
    hands: bool = True  # turn hands as the person's, where the source has them and the robot's wrists can
    weights: ObjectiveWeights = field(default_factory=ObjectiveWeights)
    whole_clip: WholeClipConfig = field(default_factory=WholeClipConfig)
    ik: IkConfig = field(default_factory=IkConfig)
    gates: Gates = field(default_factory=Gates)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.fps >= 5.0:
            raise RetargetError("setting fps", found=repr(self.fps), expected="at least 5 frames per second")
