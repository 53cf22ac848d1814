"""Every number that steers what is found and mended in a recording, with its unit. Defaults stand here and nowhere else.

Sizes and counts at which a file is refused as absurd stand with the readers that know the format.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from clips.contact import ContactRule


@dataclass(frozen=True, kw_only=True)
class RepairConfig:
    """What no body does, and how much of a clip may be mended."""

    gap_s: float = 0.1  # the longest stretch that is filled, of anything [s]
    fastest_hips: float = 12.0  # of a person or a robot [m/s]; a sprinter's
    fastest_point: float = 25.0  # of anything on a body [m/s]; a pitcher's hand
    least_left: float = 0.5  # of a clip, after a false start
    false_start_s: float = 0.5  # at either end, in which a file may jump between its rest pose and the dance [s]
    jump_turn: float = 0.26  # of a limb or a joint in one frame, that may be such a jump [rad]
    jump_speed: float = 3.0  # of the hips in one frame, that may be one [m/s]
    jump_among: int = 4  # steps on either side that a jump in mid-clip is held against
    jump_stands_out: float = 4.0  # so many times their median it is
    flash_limbs: int = 3  # that jump where a pose flashes up; a point that flies off turns two
    fastest_turn: float = 15.0  # of a limb that a person may turn out of stillness [rad/s]
    torn_turn: float = 0.8  # of a limb in one frame, beyond which two motions were joined [rad]
    stands_out: float = 5.0  # so many times the steps beside it a jump is; of 20 recordings of people 2.6 at most
    out_of_stillness: float = 2.0  # the same for the step behind frames that nothing moves in
    still_turn: float = 0.5  # of any limb in such frames [rad/s]
    stalled_speed: float = (
        0.3  # a motion so fast before and after frames that repeat does not stand between [m/s, rad/s]
    )
    still_speed: float = 0.3  # of any point of someone who stands still [m/s]
    level_arm: float = 0.35  # rise of an upper arm or forearm that is stretched out sideways, of its length
    straight_arms: float = 0.9  # of the arms' common direction


@dataclass(frozen=True, kw_only=True)
class FloorConfig:
    """When a floor leans or drifts, as cameras see it."""

    standing: ContactRule = field(default_factory=lambda: ContactRule(height=0.06, speed=0.2))  # over the floor nearby
    nearby_s: float = 1.0  # half width of "nearby" [s]
    noise: tuple[float, float] = (0.01, 0.003)  # of a standing foot's height: to find feet, then to weigh them [m]
    seen: float = 0.05  # change over the clip below which a floor is level [m]
    better: float = 0.6  # of the scatter of standing feet about a level floor, which a leaning one must undercut
    most_lean: float = 0.12  # beyond which something else is wrong: units of the root, axes [slope]
    samples: int = 10  # standing ones, for every number fitted


@dataclass(frozen=True, kw_only=True)
class SidesConfig:
    """When left and right of a body are exchanged."""

    leap: float = 0.05  # by which both points of a pair are nearer to each other's last place than to their own [m]
    bone_noise: float = 0.02  # change of a bone's length that says nothing, as a share of it
    much_less: float = 0.5  # of a change of length: exchanged, it must be so much smaller
    least_spread: float = 0.05  # of a bone's length over a clip that wants explaining
    most: float = 0.5  # of the frames that may be exchanged, beyond which nobody knows which side is right


@dataclass(frozen=True, kw_only=True)
class BodyConfig:
    """What the points of a body do."""

    no_length: float = 1e-3  # of a bone whose two ends a file puts in one place [m]
    bone_changes: float = 0.1  # of a bone's length, that markers on skin may show
    no_bone: float = 0.3  # of a bone's length, that no skin moves by
    no_body: float = 0.3  # share of frames in which a bone may do that, as feet of two centimetres of noise do
    against: float = 0.3  # cosine of hips and shoulders, below minus which they face against each other
    behind: float = 0.02  # knees and toes behind the hips' front [m]
    turned_away: float = 0.05  # share of frames in which they may


@dataclass(frozen=True, kw_only=True)
class GravityConfig:
    """What a flight is, and how it falls."""

    high: float = 0.06  # of both feet over their own floor [m]
    upright: float = 0.8  # height of the pelvis over the floor, of the leg's length
    least_s: float = 0.15  # of a flight [s]
    some: float = 2.0  # acceleration from which on another frame rate may explain it [m/s2]
    falls: tuple[float, float] = (6.0, 15.0)  # the trunk's acceleration [m/s2]; limbs that swing take and give some


@dataclass(frozen=True, kw_only=True)
class SwayConfig:
    """How a body sways over one standing foot.

    Of 62 recordings at their true rates 29 tell something: a ratio of 0.67 to 1.09, median 0.82, and one of 0.31.
    """

    smooth_hz: float = 4.0  # half-power frequency of the trunk's way [Hz]
    down: float = 0.05  # height of a foot that stands, over its own floor [m]
    upright: float = 0.9  # share of upright frames, below which a recording is of something else
    shortest: int = 4  # frames of one stand
    frames: int = 50  # of all stands together, from which on they tell something
    together: float = 0.2  # least correlation of distance and acceleration
    at_truth: float = 0.83  # ratio at the true rate
    clear: float = (
        1.38  # a factor from there, within which a rate is named; rates that are tried are a factor of 2 apart
    )
    rates: tuple[float, ...] = (30.0, 60.0, 120.0)  # that are tried
    mistaken: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0)  # of a clip's rate, that the true one may be


@dataclass(frozen=True, kw_only=True)
class LeanConfig:
    """The plane that feet stand on, and when a recording is levelled by it."""

    over_s: float = 0.1  # in which speeds are measured, and the shortest stand [s]
    longest_s: float = 0.5  # of a stand that counts fully; longer ones count no more [s]
    slow: float = 0.2  # speed of what stands [m/s]
    least_stands: int = 4
    noise: float = 0.01  # of the height of a stand [m]
    scales: tuple[float, ...] = (0.1, 0.05, 0.03, *[0.02] * 10)  # height over the plane that halves a stand's say [m]
    agreement: float = 0.03  # distance from the plane at which a stand agrees [m]
    feet_differ: float = 0.012  # between the heights of one point on the left and the right foot [m]
    parts: int = 8  # of the clip, in each of which the body's left is level
    left_leans: float = 0.1  # of the body's left on the mean over such a part [slope]
    up_leans: float = 0.15  # of the body's up on the mean over the clip [slope]
    certain: tuple[tuple[float, float], ...] = ((0.85, 5.5), (0.65, 12.0))  # stands that agree, deviations from no lean
    least_deg: float = 4.5  # below which a floor is left to what drifts; what a dance on the spot may be mistaken by
    most_deg: float = 38.0  # beyond which it is another up axis, or no floor


@dataclass(frozen=True, kw_only=True)
class TravelConfig:
    """When the feet carry the body, and how fast it then has to move."""

    over_s: float = 0.1  # in which speeds are measured [s]
    least_drive: float = 0.25  # speed of the lowest foot under the hips that tells anything [m/s]
    near_floor: float = 0.05  # height of the lowest foot over its floor [m]
    least_s: float = 0.3  # of such frames [s]
    held_height: float = 0.005  # change of the hips' height below which it was not recorded [m]
    of_drive: tuple[float, float] = (0.4, 1.7)  # the pelvis' speed as a share of it; 60 recordings have 0.44 to 1.2
    long_s: float = (
        8.0  # of such frames, from which on that holds; of shorter stretches some slide and turn on the spot [s]
    )
    least_of_drive: float = 0.12  # a share that no stretch has
    most_slip: float = 0.55  # of the lowest foot, as a share of it
    doubtful_slip: float = 0.55  # at which a floor is hardly stood on, though the travel is there
    unit_ratios: tuple[float, ...] = (100.0, 1000.0, 10.0, 2.54, 39.37, 0.4, 0.1, 0.01, 0.001, 0.0254)
    unit_slip: float = 0.4  # of the lowest foot, below which a ratio of units explains the travel


@dataclass(frozen=True, kw_only=True)
class IdentifyConfig:
    """Evidence that settles what a file means."""

    probe_frames: int = 200  # looked at by forward kinematics
    clear: float = 1.5  # the wrong order's floor must be so many times rougher
    beyond_right: float = 0.25  # per cent of joint values beyond their ranges that a file read rightly may have
    beyond_wrong: float = 0.02  # share of them that no robot's own file has
    most_tilt: float = 0.06  # median height of the flatter sole's edge over its other edge [m]
    shortest: float = 0.5  # of a person [m]
    absurd: float = 1e9  # no place of anybody, in any unit
    tallest: float = 2.6  # [m]
    leg_share: float = 0.491  # thigh and shank over stature (Drillis & Contini 1966: .245 + .246)
    legs: tuple[float, float] = (0.62, 1.05)  # of a person, by which a unit is found [m]
    bodies_frames: int = 20  # of a file whose bodies are held against its joints
    bodies_fit: float = 0.03  # between stated bodies and those of the joints [m]
    bodies_off: float = (
        0.1  # beyond which names are wrong [m]; another version of a robot misses by 0.05, they by 0.12 and more
    )
    moving: float = 0.2  # speed of a joint that tells a rate [rad/s]
    no_velocity: float = 1e-3  # share of its positions' velocity at which a stated one is a placeholder
    rates_fit: float = 1.2  # times its positions' velocity that a stated velocity may be
    long_bone: float = 0.2  # of a limb's segment, that two bones in it must have for it to begin between them
    bends_deg: float = 5.0  # by which such bones are no straight line, and a limb's direction is not that of its bone
    stature: float = 1.7  # of a person whose unit is none of the customary ones [m]


REPAIR, SIDES, FLOOR, LEAN = RepairConfig(), SidesConfig(), FloorConfig(), LeanConfig()
BODY, GRAVITY, SWAY, TRAVEL, IDENTIFY = BodyConfig(), GravityConfig(), SwayConfig(), TravelConfig(), IdentifyConfig()
