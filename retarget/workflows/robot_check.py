"""A robot tried out: does it stand, does a dance come out inside the gates, and what in its profile to look at."""

from __future__ import annotations

from dataclasses import dataclass

from clips import Clip
from retarget.pipeline import Retargeted, retarget
from robot_models import RobotModel
from robot_models.draft import STANDS_S, standing_seconds

# What to look at in a profile when a number of the report is off.
_HINTS = {
    "joint position": "ranges in the model file",
    "joint speed": "[joints.velocity]: is the robot that slow?",
    "joint acceleration": "[joints.effort] and [joints.armature]",
    "deepest point under the floor": "[soles.*] (z, x, y) and the capsules of feet and shins",
    "self-collision": "[capsules.*] and excludes: links that overlap by construction",
    "slide": "[soles.*], and landmarks left_foot and right_foot",
    "limb direction": "[landmarks]: hips, knees, shoulders, elbows, wrists; and whether at zero all face +x",
    "airborne": "[soles.*].z",
    "hovering": "[soles.*].z and [default_pose]",
}
_LIMB_ERROR = 20.0  # beyond which landmarks are doubted [deg]


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
            doubted = metric.name == "limb direction error" and metric.value > _LIMB_ERROR
            if not metric.passed or doubted:
                hint = next((h for k, h in _HINTS.items() if k in metric.name), "the profile")
                wrong.append(f"{hint}: {metric.name} is {metric.value:.3g} {metric.unit}")
        return tuple(wrong)


def check_robot(robot: RobotModel, dance: Clip) -> RobotCheck:
    """Let a robot stand, and bring a dance to it."""
    return RobotCheck(stood_s=standing_seconds(robot), result=retarget(dance, robot))
