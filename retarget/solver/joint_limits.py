"""Hard limits of joint position, speed and acceleration, as constraints of the whole-clip solver.

Each bounds a time difference of the joint angles, of order 0, 1 or 2. The quadratic problem of a Gauss-Newton step is
solved with these bounds by the primal-dual active-set method (Hintermueller, Ito, Kunisch 2002): rows of the set are
held at their bound by a stiff spring whose force is the multiplier; a row whose spring is slack leaves, a row beyond
its bound joins.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from retarget.config import WholeClipConfig
from robot_models import RobotModel
from robot_models.maths import HALF_BANDWIDTH, BandedSystem, difference_transposed, dilate

_ROUNDING = 1e-7
_HELD = 1e10  # keeps a frame where it is


class JointLimit:
    """lower <= order-th time difference of the joint angles <= upper."""

    def __init__(
        self,
        order: int,
        lower: Float[ndarray, "J"],
        upper: Float[ndarray, "J"],
        side: ndarray,
        config: WholeClipConfig = WholeClipConfig(),
    ) -> None:
        self.order, self.lower, self.upper, self._config = order, lower, upper, config
        self._side: ndarray = side  # (T - order, J): -1 held below, 1 held above
        self._joined = np.ones(len(side), dtype=bool)  # rows of consecutive frames

    def part(self, frames: Int[ndarray, "F"]) -> JointLimit:
        """The bound on some of the frames; rows across a gap between them bind nothing."""
        out = JointLimit(self.order, self.lower, self.upper, self._side[:0], self._config)
        first = frames[: max(0, len(frames) - self.order)]
        out._joined = frames[self.order :] - first == self.order
        out._side = np.where(out._joined[:, None], self._side[np.minimum(first, len(self._side) - 1)], 0)
        return out

    def take(self, part: JointLimit, frames: Int[ndarray, "F"]) -> None:
        """Take over the active set of a part."""
        first = frames[: len(part._side)][part._joined]
        self._side[first] = part._side[part._joined]

    def add_to(self, system: BandedSystem, gradient: Float[ndarray, "T n"], joints: Float[ndarray, "T J"]) -> None:
        """Add the springs of the held rows, for a step from `joints`."""
        if self._side.any():
            weight = self._config.limit_springs[self.order] * (self._side != 0)
            first = gradient.shape[1] - joints.shape[1]
            system.add_differences(self.order, weight, first)
            stretch = np.diff(joints, self.order, axis=0) - self._held()
            gradient[:, first:] += difference_transposed(weight * stretch, self.order)

    def update(self, joints: Float[ndarray, "T J"]) -> int:
        """Let rows join and leave by a solution; how many did."""
        value = np.diff(joints, self.order, axis=0)
        beyond = np.where(value > self.upper + _ROUNDING, 1, np.where(value < self.lower - _ROUNDING, -1, 0))
        taut = self._side * (value - self._held()) > 0.0
        side = np.where(self._side != 0, self._side * taut, beyond)
        side[~self._joined] = 0
        changed = int((side != self._side).sum())
        self._side = side
        return changed

    def violation(self, joints: Float[ndarray, "T J"]) -> Bool[ndarray, "Td J"]:
        """Which rows are beyond their bound by more than its margin forgives."""
        value, slack = np.diff(joints, self.order, axis=0), self._config.limit_slack * (self.upper - self.lower)
        return np.asarray((value > self.upper + slack) | (value < self.lower - slack))

    def touched(self, rows: Bool[ndarray, "Td J"]) -> Bool[ndarray, "T"]:
        """Frames that take part in some of the rows."""
        hit = np.asarray(rows.any(axis=1))
        out: ndarray = np.zeros(len(hit) + self.order, dtype=bool)
        for k in range(self.order + 1):
            out[k : k + len(hit)] |= hit
        return out

    def _held(self) -> ndarray:
        return np.where(self._side > 0, self.upper, self.lower)


def joint_limits(robot: RobotModel, frames: int, fps: float, config: WholeClipConfig) -> list[JointLimit]:
    """The robot's limits over a clip, each kept with a margin so that rounding cannot break it."""
    lower, upper = robot.ranges(config.limit_margin)
    speed = config.speed_share * robot.velocity / fps
    turn = config.acceleration_share * robot.acceleration / fps**2
    limits = ((lower, upper), (-speed, speed), (-turn, turn))  # of position, speed, acceleration
    return [
        JointLimit(order, low, high, np.zeros((max(0, frames - order), len(low)), dtype=np.int8), config)
        for order, (low, high) in enumerate(limits)
    ]


def project(
    limits: list[JointLimit], joints: Float[ndarray, "T J"], reach: int, config: WholeClipConfig = WholeClipConfig()
) -> Float[ndarray, "T J"]:
    """The nearest motion within all bounds, changed smoothly; only frames within `reach` of a broken one change.

    Where none was found, for motors that are too weak by far, joints stop at the ends of their ranges all the same.
    """
    broken = np.any([b.touched(b.violation(joints)) for b in limits], axis=0)
    if not broken.any():
        return joints
    moving = dilate(broken, reach)
    frames = np.flatnonzero(dilate(moving, HALF_BANDWIDTH))
    part, start = [b.part(frames) for b in limits], joints[frames]
    # Where the limits leave hardly any way, a smoother motion finds one.
    for smoothness in config.projection_smoothness:
        step, settled = _within(part, start, moving[frames], smoothness, config.limit_rounds)
        if settled:
            break
    out = np.array(joints)
    out[frames] += step
    if not settled:
        for ends in (limit for limit in limits if limit.order == 0):
            out = np.clip(out, ends.lower, ends.upper)
    return out


def _within(
    limits: list[JointLimit], start: ndarray, moving: ndarray, smoothness: float, rounds: int
) -> tuple[ndarray, bool]:
    """The small and smooth step within the bounds, and whether the active sets came to rest.

    smoothness weighs the third differences of the motion against the size of the step.
    """
    stay = np.where(moving, 1.0 - smoothness, _HELD)
    stay = stay[:, None, None] * np.eye(start.shape[1])
    coarse, step = np.zeros_like(start), np.zeros_like(start)
    if len(start) > HALF_BANDWIDTH:
        coarse = difference_transposed(smoothness * np.diff(start, HALF_BANDWIDTH, axis=0), HALF_BANDWIDTH)
    for _ in range(rounds):
        system, pull = BandedSystem(stay), coarse.copy()
        system.add_differences(HALF_BANDWIDTH, np.ones((max(0, len(start) - HALF_BANDWIDTH), start.shape[1])))
        for limit in limits:
            limit.add_to(system, pull, start)
        step = -system.solve(pull)
        if not sum(limit.update(start + step) for limit in limits):
            return step, True
    return step, False
