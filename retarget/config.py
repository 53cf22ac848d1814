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
    min_duration_s: float = 0.08  # a shorter touch is noise, a shorter gap is no step [s]
    pivot_rate: float = 1.5  # foot yaw rate above which a touching foot turns on purpose [rad/s]


@dataclass(frozen=True, kw_only=True)
class IkWeights:
    """Costs of the per-frame IK: per metre for positions, per radian for orientations."""

    foot_position: float = 20.0  # of a touching foot
    foot_orientation: float = 3.0
    swing_position: float = 5.0  # of a swinging one: the legs' directions matter more than its exact path
    swing_orientation: float = 0.5
    pelvis_position: float = 4.0
    pelvis_orientation: float = 2.0
    torso_orientation: float = 2.0
    thigh_and_shin: float = 3.0  # per metre at the limb's end
    arm: float = 4.0  # upper arm and forearm, the same
    posture: float = 0.06
    repair_posture: float = 2.0  # how firmly the foot-repair pass keeps the smoothed joints


@dataclass(frozen=True, kw_only=True)
class IkConfig:
    """The per-frame solver."""

    weights: IkWeights = field(default_factory=IkWeights)
    iterations: int = 4  # per frame, warm-started
    first_iterations: int = 80  # so that frame 0 is converged
    repair_iterations: int = 4
    damping: float = 1e-3
    limit_margin: float = 0.01  # kept from each joint limit [rad]
    clearance: float = 0.003  # kept between bodies that would touch, and between bodies and the floor [m]
    velocity_share: float = 0.95  # of each motor's speed limit, per output frame


@dataclass(frozen=True, kw_only=True)
class Gates:
    """What a reference has to keep to be called feasible."""

    penetration_mm: float = 5.0  # deepest point under the floor
    slide_mm: float = 30.0  # worst slide of one touch of a foot edge
    self_collision_mm: float = 10.0  # deepest overlap of two bodies
    joint_limit_rad: float = 1e-6  # beyond a position limit
    velocity_share: float = 1.0  # of the motors' speed limits
    airborne_points: float = 6.0  # difference of the airborne share to the source's, percentage points
    hovering_frames: float = 5.0  # of lead-in and lead-out


@dataclass(frozen=True, kw_only=True)
class RetargetConfig:
    """From clip to reference."""

    fps: float = 50.0  # of the reference [frames/s]
    lead_in_s: float = 1.0  # stand -> first pose [s]
    lead_out_s: float = 1.0  # last pose -> stand [s]
    stand_s: float = 0.3  # standing still at both ends [s]
    smooth_hz: float = 5.0  # half-power frequency of the joint smoother [Hz]
    reach: float = 0.985  # longest hip-ankle distance of a planted leg, of the leg's length
    contact: ContactConfig = field(default_factory=ContactConfig)
    ik: IkConfig = field(default_factory=IkConfig)
    gates: Gates = field(default_factory=Gates)

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, float) and not 0.0 <= value < 1e6:
                raise RetargetError(f"setting {f.name}", found=repr(value), expected="a number of at least 0")
        if not self.fps >= 5.0:
            raise RetargetError("setting fps", found=repr(self.fps), expected="at least 5 frames per second")
