"""What a motion is judged by: fixed rules that no setting can flatter, and the gates that it has to keep."""

from __future__ import annotations

from dataclasses import dataclass, fields

from clips import ContactRule
from retarget.errors import RetargetError

GRAVITY = 9.81  # both engines' default [m/s^2]


class Checked:
    """Refuses numbers that no setting can have, in every group of settings by itself."""

    def __post_init__(self) -> None:
        for f in fields(self):  # type: ignore[arg-type]
            value = getattr(self, f.name)
            for number in value if isinstance(value, tuple) else (value,):
                if isinstance(number, int | float) and not 0.0 <= number <= 1e6:
                    raise RetargetError(f"setting {f.name}", found=repr(value), expected="a number of at least 0")


@dataclass(frozen=True, kw_only=True)
class DynamicsConfig(Checked):
    """What counts against a motion: a score of 1 for each of the gates.

    The ratio of the first two, 0.4 m, is about a humanoid's radius of gyration: force and moment weigh alike by how fast
    they would move its parts.
    """

    force_gate: float = 0.25  # missing force, of the weight: the CoM would go 2.5 m/s^2 another way
    moment_gate: float = 0.1  # missing moment, of the weight times 1 m: a ZMP 10 cm out of reach, were no force missing
    effort_gate: float = 0.25  # torque beyond the motor's, of the motor's
    carried: float = 0.1  # of the weight: with less on the floor the ZMP says nothing
    carrying: ContactRule = ContactRule(height=0.01, speed=0.3)  # an unlabelled sole point that carries all the same
    part_height: float = 0.02  # of any other part of the body that carries [m]
    level: float = 0.5  # upward part of a sole's normal, above which nothing but the sole of a foot carries
    clear_height: float = 0.03  # a point higher than this carries nothing, whatever its label says [m]


@dataclass(frozen=True, kw_only=True)
class ReportConfig(Checked):
    """The fixed rules of the report: no other setting can flatter it."""

    rate: float = 30.0  # derivatives are compared at this rate [Hz]: at the file's own rate, noise would decide
    contact: ContactRule = ContactRule(height=0.04, speed=0.25)  # of the source's edges over their own floor
    shortest_contact: int = 3  # frames; a shorter one is noise
    pivot_rate: float = 1.5  # [rad/s]
    airborne_height: float = 0.02  # of the robot's lowest point [m]
    down: float = (
        0.15  # of any joint of the source but the feet's over the floor: flesh that lies on it is as thick [m]
    )
    upright: float = 0.75  # height of the pelvis over the floor, of the leg's length: whoever sits needs no feet
    longest_flight_s: float = 0.8  # what a person jumps; longer ones hover [s]
    under_floor: float = 0.002  # of the robot's lowest point, that counts a frame [m]
    overlap: float = 0.005  # of two bodies, that counts a frame [m]


@dataclass(frozen=True, kw_only=True)
class DiagnosisConfig(Checked):
    """What is said about a gate that does not hold."""

    margin_s: float = 0.3  # left out on either side of what is dropped [s]
    shortest_s: float = 2.0  # a shorter rest is not worth keeping [s]
    most_dropped: float = 0.4  # of a dance; beyond it one stretch is kept instead
    most_drops: int = 4
    slid_m: float = 0.015  # of the recording's own foot, that explains a slide [m]
    poor_feet: float = 0.1  # share of frames with feet that hover or skate, that explains a poor result


@dataclass(frozen=True, kw_only=True)
class Gates(Checked):
    """What a reference has to keep to be called feasible."""

    penetration_mm: float = 5.0  # deepest point under the floor
    slide_mm: float = 30.0  # worst slide of one touch of a foot edge
    self_collision_mm: float = 10.0  # deepest overlap of two bodies
    joint_limit_rad: float = 1e-6  # beyond a position limit
    speed_share: float = 1.0  # of the motors' speed limits, frame to frame
    acceleration_share: float = 1.0  # of what the motors can do against the default pose's inertia, frame to frame
    airborne_points: float = 6.0  # difference of the airborne share to the source's, percentage points
    unsupported_percent: float = 50.0  # of the frames, upright on feet that neither stand nor fly
    hovering_frames: float = 5.0  # of lead-in and lead-out
