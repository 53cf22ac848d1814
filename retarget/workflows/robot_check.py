"""A robot tried out: does it stand, does a dance come out inside the gates, and what in its profile to look at."""

from __future__ import annotations

from dataclasses import dataclass

from clips import Clip, MetricKey
from retarget.pipeline import Retargeted, retarget
from robot_models import RobotModel
from robot_models.draft import STANDS_S, standing_seconds

_SOLES = "[soles.*] (z, x, y)"
_HINTS = {  # what to look at in a profile when a number of the report is off
    MetricKey.POSITION_BEYOND_LIMITS: "ranges in the model file",
    MetricKey.SPEED_SHARE: "[joints.velocity]: is the robot that slow?",
    MetricKey.ACCELERATION_SHARE: "[joints.effort] and [joints.armature]",
    MetricKey.PENETRATION: f"{_SOLES} and the capsules of feet and shins",
    MetricKey.SELF_COLLISION: "[capsules.*] and excludes: links that overlap by construction",
    MetricKey.SLIDE_WORST: "[soles.*], and landmarks left_foot and right_foot",
    MetricKey.LIMB_DIRECTION_ERROR: (
        "[landmarks]: hips, knees, shoulders, elbows, wrists; and whether at zero all face +x"
    ),
    MetricKey.TORQUE_SHARE: "[joints.effort]: are the motors that weak, or is it the masses?",
    MetricKey.AIRBORNE_OFF_SOURCE: _SOLES,
    MetricKey.HOVERING_LEADS: f"{_SOLES} and [default_pose]",
}
# Beyond which a number that has no gate is doubted: of seventeen robots on the drill fifteen have less.
_DOUBTED = {MetricKey.LIMB_DIRECTION_ERROR: 8.0, MetricKey.TORQUE_SHARE: 1.5}


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotCheck:
    """What a robot's trial came to."""

    stood_s: float  # on its servos alone, of `STANDS_S`
    result: Retargeted

    @property
    def to_mend(self) -> tuple[str, ...]:
        """What to look at in the profile, and the number that says so; nothing where all is well."""
        wrong = []
        if self.stood_s < STANDS_S:
            wrong.append("[joints.kp], [joints.kd], [default_pose] and [soles.*]: it falls when it should stand")
        for metric in self.result.report.metrics:
            doubted = metric.key in _DOUBTED and metric.value > _DOUBTED[metric.key]
            if not metric.passed or doubted:
                hint = _HINTS.get(metric.key, "the profile")
                wrong.append(f"{hint}: {metric.label} is {metric.value:.3g} {metric.unit}")
        return tuple(wrong)


def check_robot(robot: RobotModel, dance: Clip) -> RobotCheck:
    """Let a robot stand, and bring a dance to it."""
    return RobotCheck(stood_s=standing_seconds(robot), result=retarget(dance, robot))
