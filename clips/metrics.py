"""The numbers that a reference's report is made of: a key for programs, a label for people."""

from __future__ import annotations

from enum import StrEnum


class MetricKey(StrEnum):
    """One number of a report; docs/report.md defines each."""

    POSITION_BEYOND_LIMITS = "joint_position_beyond_limits"
    SPEED_SHARE = "joint_speed_share"
    ACCELERATION_SHARE = "joint_acceleration_share"
    SPEED_MAX = "joint_speed_max"
    ACCELERATION_P95 = "joint_acceleration_p95"
    JERK_P95 = "joint_jerk_p95"
    PENETRATION = "penetration"
    FRAMES_UNDER_FLOOR = "frames_under_floor"
    SELF_COLLISION = "self_collision"
    FRAMES_SELF_COLLIDING = "frames_self_colliding"
    LIMB_DIRECTION_ERROR = "limb_direction_error"
    HAND_TURN_ERROR = "hand_orientation_error"
    HAND_IN_REACH = "hand_orientation_in_reach"
    CONTACT_SPEED = "contact_speed_mean"
    SLIDE_MEAN = "contact_slide_mean"
    SLIDE_WORST = "contact_slide_worst"
    CONTACT_HEIGHT = "contact_height_mean"
    CONTACT_SHARE = "contact_share_of_source"
    AIRBORNE = "airborne_frames"
    AIRBORNE_SOURCE = "airborne_frames_of_source"
    AIRBORNE_OFF_SOURCE = "airborne_frames_off_source"
    UNSUPPORTED = "unsupported_frames"
    HOVERING_LEADS = "hovering_in_leads"
    IMPOSSIBLE_FRAMES = "impossible_frames"
    TORQUE_SHARE = "joint_torque_share_p99"
    BEAT_ERROR = "beat_error_median"
    BEAT_ERROR_P95 = "beat_error_p95"
    ON_BEAT = "beats_with_an_accent"
    BEAT_ERROR_RECORDED = "beat_error_median_of_source"
    ON_BEAT_RECORDED = "beats_with_an_accent_of_source"

    @property
    def label(self) -> str:
        """In words, as reports show it."""
        return _LABELS[self]

    @property
    def higher_is_better(self) -> bool:
        """Whether the smaller of two values is the worse one."""
        return self in (
            MetricKey.CONTACT_SHARE, MetricKey.HAND_IN_REACH, MetricKey.ON_BEAT, MetricKey.ON_BEAT_RECORDED
        )  # fmt: skip


_LABELS = {
    MetricKey.POSITION_BEYOND_LIMITS: "joint position beyond limits",
    MetricKey.SPEED_SHARE: "joint speed, share of the motor's",
    MetricKey.ACCELERATION_SHARE: "joint acceleration, share of the motor's",
    MetricKey.SPEED_MAX: "joint speed, max",
    MetricKey.ACCELERATION_P95: "joint acceleration, p95",
    MetricKey.JERK_P95: "joint jerk, p95",
    MetricKey.PENETRATION: "deepest point under the floor",
    MetricKey.FRAMES_UNDER_FLOOR: "frames under the floor",
    MetricKey.SELF_COLLISION: "deepest self-collision",
    MetricKey.FRAMES_SELF_COLLIDING: "frames with self-collision",
    MetricKey.LIMB_DIRECTION_ERROR: "limb direction error",
    MetricKey.HAND_TURN_ERROR: "hand orientation error, where the wrist can",
    MetricKey.HAND_IN_REACH: "hand orientations that the wrists can",
    MetricKey.CONTACT_SPEED: "speed of a touching edge, mean",
    MetricKey.SLIDE_MEAN: "slide per touch, mean",
    MetricKey.SLIDE_WORST: "slide per touch, worst",
    MetricKey.CONTACT_HEIGHT: "height of a touching edge, mean",
    MetricKey.CONTACT_SHARE: "touching share of the source",
    MetricKey.AIRBORNE: "airborne frames",
    MetricKey.AIRBORNE_SOURCE: "airborne frames of the source",
    MetricKey.AIRBORNE_OFF_SOURCE: "airborne frames, off the source",
    MetricKey.UNSUPPORTED: "frames that nothing carries",
    MetricKey.HOVERING_LEADS: "hovering in the leads",
    MetricKey.IMPOSSIBLE_FRAMES: "frames that physics does not allow",
    MetricKey.TORQUE_SHARE: "joint torque, share of the motor's",
    MetricKey.BEAT_ERROR: "beat error, median",
    MetricKey.BEAT_ERROR_P95: "beat error, p95",
    MetricKey.ON_BEAT: "beats with an accent",
    MetricKey.BEAT_ERROR_RECORDED: "beat error at the recorded pace, median",
    MetricKey.ON_BEAT_RECORDED: "beats with an accent at the recorded pace",
}
_KEY_OF = {label: key for key, label in _LABELS.items()}


def metric_key(name: str) -> str:
    """The key of a metric that a file names by its key or, as releases before 0.2 did, by its label; else the name itself."""
    return str(_KEY_OF.get(name, name))


def metric_label(name: str) -> str:
    """The label of a metric that a file names; of one that nobody knows here, the name itself."""
    key = metric_key(name)
    return MetricKey(key).label if key in set(MetricKey) else name
