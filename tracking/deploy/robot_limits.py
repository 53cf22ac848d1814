"""What a robot's own profile lets a policy do: nothing that a bundle says can widen it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel, expand_patterns
from tracking.deploy.messages import Command
from tracking.errors import TrackingError, shortened
from tracking.policy import Contract, anchor_chain, standing_gains

_SAME = 1e-6  # relative: the same number after a file
_PERIODS = (0.005, 0.05)  # of control: the servos' own and the guard's time scale [s]


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotLimits:
    """Limits, gains and order of one robot's joints, from its profile. J joints in the robot's order."""

    robot: RobotModel
    kp_band: Float[ndarray, "2 J"]  # lowest and highest stiffness that a policy may ask for [N m/rad]
    kd_band: Float[ndarray, "2 J"]  # [N m s/rad]
    stand_kp: Float[ndarray, "J"]  # that stand without a policy [N m/rad]
    stand_kd: Float[ndarray, "J"]  # and damp without one [N m s/rad]

    @classmethod
    def of(cls, robot: RobotModel) -> RobotLimits:
        """Those of a robot's profile.

        Raises:
            TrackingError: the profile states no bands for its gains: nobody has said what its servos stand.
        """
        profile = robot.profile
        if not (profile.kp_band and profile.kd_band):
            raise TrackingError(
                f"robot {robot.name}", found="a profile without [joints.kp_band] and [joints.kd_band]",
                expected="the gains that its servos stand", cure="measure them, and state them in the profile",
            )  # fmt: skip
        kp, kd = standing_gains(robot)
        bands = [_band(getattr(profile, name), robot, name) for name in ("kp_band", "kd_band")]
        return cls(robot=robot, kp_band=bands[0], kd_band=bands[1], stand_kp=kp, stand_kd=kd)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """In the robot's order."""
        return self.robot.joint_names

    def damping(self) -> Command:
        """Soft joints that resist motion; it needs no number of a state, which may itself be what is wrong."""
        return Command(target=self.robot.default_joint_pos, kp=np.zeros_like(self.stand_kp), kd=self.stand_kd.copy())

    def bounded(self, command: Command) -> Command:
        """The command within the limits: gains in their bands, targets no farther out than full effort pulls."""
        kp = np.clip(command.kp, 0.0, np.maximum(self.kp_band[1], self.stand_kp))
        kd = np.clip(command.kd, 0.0, np.maximum(self.kd_band[1], self.stand_kd))
        reach = self.robot.effort / np.maximum(kp, self.kp_band[0])
        return Command(target=np.clip(command.target, self.robot.lower - reach, self.robot.upper + reach), kp=kp, kd=kd)

    def check(self, contract: Contract) -> None:
        """Refuse a policy that was made for another robot, or whose numbers this one's profile does not bear out.

        Raises:
            TrackingError: what differs, and what the profile says.
        """
        robot, told = self.robot, contract
        self._same("robot", told.robot, robot.name)
        self._same("joint_names", told.joint_names, robot.joint_names)
        self._same("robot_hash", told.robot_hash, robot.hash)
        self._same("anchor_chain", told.anchor_chain, anchor_chain(robot, told.anchor))
        for name in ("effort", "velocity", "lower", "upper"):
            self._within(name, getattr(told, name), getattr(robot, name), getattr(robot, name))
        reach = robot.effort / np.maximum(told.kp, self.kp_band[0])
        self._within("kp", told.kp, *self.kp_band)
        self._within("kd", told.kd, *self.kd_band)
        self._within("stand_kp", told.stand_kp, np.zeros_like(reach), np.maximum(self.kp_band[1], self.stand_kp))
        self._within("stand_kd", told.stand_kd, np.zeros_like(reach), np.maximum(self.kd_band[1], self.stand_kd))
        self._within("default_joint_pos", told.default_joint_pos, robot.lower, robot.upper)
        self._within("target_lower", told.target_lower, robot.lower - reach, robot.upper)
        self._within("target_upper", told.target_upper, robot.lower, robot.upper + reach)
        self._within("action_scale", told.action_scale, np.zeros_like(reach), np.full_like(reach, 2.0 * np.pi))
        if not _PERIODS[0] <= told.control_dt <= _PERIODS[1]:
            raise self._refused("control_dt", f"{told.control_dt:g} s", f"between {_PERIODS[0]} and {_PERIODS[1]} s")

    def _within(self, name: str, told: ndarray, lowest: ndarray, highest: ndarray) -> None:
        slack = _SAME * np.maximum(1.0, np.maximum(np.abs(lowest), np.abs(highest)))
        wrong = ~((told >= lowest - slack) & (told <= highest + slack))
        if wrong.any():
            j = int(np.argmax(wrong))
            span = f"{lowest[j]:g}" if lowest[j] == highest[j] else f"{lowest[j]:g} to {highest[j]:g}"
            raise self._refused(f"{name} of {self.joint_names[j]}", f"{told[j]:g}", span)

    def _same(self, name: str, told: Any, own: Any) -> None:
        if told != own:
            raise self._refused(name, shortened(told), shortened(own))

    def _refused(self, what: str, found: str, expected: str) -> TrackingError:
        return TrackingError(
            f"contract, {what}", found=found, expected=f"{expected}, by the profile of {self.robot.name}",
            cure="export the policy for this robot; the profile is not to be widened for a policy's sake",
        )  # fmt: skip


def _band(table: Any, robot: RobotModel, name: str) -> ndarray:
    ends = (
        expand_patterns({k: v[end] for k, v in table.items()}, robot.joint_names, where=f"{robot.name}, {name}")
        for end in (0, 1)
    )
    return np.array(list(ends))
