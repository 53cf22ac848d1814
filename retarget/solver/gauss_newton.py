"""The lines that move the robot: Gauss-Newton over all frames at once, within joint limits and clearances.

A step is trusted frame by frame: where the linearised goals promised much more than came true, that frame's damping
grows (Levenberg-Marquardt), and where it came out far worse the step is taken back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from retarget.config import GridStage, PhysicsConfig, WholeClipConfig
from retarget.solver.collision import WORLD, Clearance, Places, Watch, low_soles, too_near
from retarget.solver.floor_wrench import FloorWrench
from retarget.solver.joint_limits import joint_limits, project
from retarget.solver.normal_equations import constrained_step, normal_equations
from retarget.solver.objective import Objective
from retarget.solver.residuals import residual_rows
from robot_models import Kinematics, RobotModel, integrate, kinematics
from robot_models.maths import HALF_BANDWIDTH, band_memory, dilate

_HELD = 1e10  # damping that lets a frame not move


def refine(
    robot: RobotModel,
    objective: Objective,
    start: Float[ndarray, "T nq"],
    fps: float,
    stage: GridStage,
    config: WholeClipConfig,
    physics: PhysicsConfig | None = None,
    anew: Bool[ndarray, "T"] | None = None,
) -> Float[ndarray, "T nq"]:
    """Improve a motion on one grid: all frames a few times, then the stretches that still move until they rest.

    Args:
        robot: the robot.
        objective: what to reach, on the grid's frames.
        start: where to begin.
        fps: frames per second of the grid.
        stage: iterations and what to respect.
        config: the solver's numbers.
        physics: what to make possible, of a motion that is at its goals.
        anew: frames that are not, where the others are; the first and the last few stay as they are.

    Raises:
        RetargetError: the problem has no finite solution.
    """
    if objective.part_weight.shape[1]:
        more = 0 if physics is None else physics.floor_iterations
        stage = replace(stage, rounds=config.floor_rounds, more_iterations=stage.more_iterations + more)
    descent = _Descent(robot, objective, start, fps, stage, config, physics)
    margin = max(HALF_BANDWIDTH, round(config.settle_margin_s * fps))
    if anew is not None:
        descent.wanted = np.where(anew, np.inf, 0.0)
    for k in range(stage.iterations + stage.more_iterations):
        active = np.ones(len(start), dtype=bool) if k < stage.iterations else descent.active_frames(margin)
        if anew is not None:
            active[:margin] = active[-margin:] = False
        if not active.any():
            break
        descent.iterate(active)
    return descent.result(margin)


class _Descent:
    """The state of the iteration: configurations, trust and active limits of every frame."""

    def __init__(
        self,
        robot: RobotModel,
        objective: Objective,
        start: ndarray,
        fps: float,
        stage: GridStage,
        config: WholeClipConfig,
        physics: PhysicsConfig | None,
    ) -> None:
        frames = len(start)
        self._robot, self._objective, self._level, self._config = robot, objective, stage, config
        limits = [config.travel_hz] * 2 + [config.height_hz] + [np.inf] * (robot.model.nv - 3)
        self._bandwidths = np.minimum(stage.smooth_hz, limits) / fps
        self._limits = joint_limits(robot, frames, fps, config)
        for limit in self._limits:
            limit.update(start[:, 7:])  # what the start breaks is held from the first step on
        self._watch = Watch(robot, frames, config.watched_gap) if stage.clearance else None
        self._damping = np.full(frames, config.damping)
        self._before, self._predicted = np.full(frames, np.inf), np.full(frames, np.inf)  # squared residuals
        self._memory = band_memory(frames, robot.model.nv)
        self.qpos, self._last = np.array(start), np.array(start)
        self._moved = np.ones(frames, dtype=bool)  # in the last iteration
        self._floor = (
            None if physics is None else FloorWrench(robot, objective.contact, objective.airborne, start, fps, physics)
        )
        self.wanted = np.full(frames, np.inf)  # how far each frame wanted to go in its last iteration [rad or m]

    def active_frames(self, margin: int) -> Bool[ndarray, "T"]:
        """Frames that still move, or that miss something that must hold, and those around."""
        if np.isinf(self.wanted).all():  # of a motion that shall become possible the goals were solved before
            missed = self._floor is None and self._missed_requirements()
            self.wanted = np.where(np.broadcast_to(missed, self.wanted.shape), np.inf, 0.0)
        c = self._config
        # Beyond a limit and at rest is where its spring ends; the rest is projected away.
        restless = (self.wanted > c.settled) | (self._violates_limits() & (self.wanted > c.at_rest))
        active = dilate(restless, margin)
        if self._floor is not None:
            frames = np.flatnonzero(dilate(self._moved, 2))  # what a frame needs hangs on its neighbours
            qpos = self.qpos[frames]
            kin = kinematics(self._robot, qpos)
            active |= self._floor.beyond(frames, kin, qpos) | dilate(self._crowded(frames, kin, qpos), margin)
        return active

    def _crowded(self, frames: ndarray, kin: Kinematics, qpos: ndarray) -> Bool[ndarray, "T"]:
        """Of some frames those in which surfaces are too near each other."""
        out = np.zeros(len(self.qpos), dtype=bool)
        if self._watch is not None:
            places, wanted, _ = _near_places(self._watch, frames, qpos, kin, self._config)
            out[frames[places.frame[too_near(places.gap, wanted)]]] = True
        return out

    def _missed_requirements(self) -> ndarray:
        kin = kinematics(self._robot, self.qpos)
        residual, _, body_rows = residual_rows(self._objective, kin)
        missed = _squared(residual[:, body_rows:]) > self._config.feet_off
        pinned = self._objective.posture_weight == self._objective.weights.pin
        missed |= (pinned & (np.abs(self.qpos[:, 7:] - self._objective.posture) > self._config.pin_off)).any(axis=1)
        return missed | self._crowded(np.arange(len(missed)), kin, self.qpos)

    def _violates_limits(self) -> ndarray:
        """Frames beyond a joint limit."""
        joints = self.qpos[:, 7:]
        return np.any([limit.touched(limit.violation(joints)) for limit in self._limits], axis=0)

    def result(self, margin: int) -> Float[ndarray, "T nq"]:
        """The result without steps that failed, moved into the joint limits where it still leaves them."""
        moved = np.flatnonzero(self.wanted > self._config.settled)
        if len(moved):
            self._evaluated(moved)
        return np.concatenate(
            (self.qpos[:, :7], project(self._limits, self.qpos[:, 7:], 2 * margin, self._config)), axis=1
        )

    def _clearance(self, frames: Int[ndarray, "n"], qpos: Float[ndarray, "n nq"], kin: Kinematics) -> Clearance | None:
        if self._watch is None:
            return None
        places, wanted, spring = _near_places(self._watch, frames, qpos, kin, self._config)
        return Clearance(places, kin, wanted, spring, self._config.held_slack)

    def iterate(self, moving: Bool[ndarray, "T"]) -> None:
        """One Gauss-Newton step of some frames; the others stand still."""
        config = self._config
        # The frames beside a stretch take part in its problem, held; so held, they also part one stretch from the next.
        self._moved = dilate(moving, HALF_BANDWIDTH)
        frames = np.flatnonzero(self._moved)
        objective = self._objective.at(frames)
        actual, kin, residual, jacobian, body_rows = self._evaluated(frames)
        qpos = self.qpos[frames]
        rows = None if self._floor is None else self._floor.rows(frames, kin, qpos)
        lacking = 0.0 if rows is None else rows.squared(len(frames))
        damping = self._update_damping(frames, actual + lacking)
        limits = [limit.part(frames) for limit in self._limits]
        clearance = self._clearance(frames, qpos, kin)
        held = np.where(moving[frames], damping, _HELD)
        model = normal_equations(objective, qpos, residual, jacobian, body_rows, held, self._bandwidths)
        step = constrained_step(model, qpos[:, 7:], limits, clearance, self._level.rounds, self._memory, rows)
        wanted = np.abs(step).max(axis=1)
        step *= _share(wanted, config.largest_turn)[:, None]
        self.wanted[frames] = wanted
        if clearance is not None:
            self.wanted[frames[clearance.missed]] = np.inf
            # What was parted is no longer near enough to be watched, and shall not leap back: small steps from here on.
            parted = frames[clearance.parted]
            self._damping[parted] = np.maximum(self._damping[parted], config.parted_damping)
        self._before[frames] = _squared(residual) + lacking
        self._predicted[frames] = _squared(residual + (jacobian @ step[..., None])[..., 0])
        if rows is not None and self._floor is not None:
            self._predicted[frames] += rows.squared(len(frames), step)
            self._floor.remember(frames, rows)
        self._last[frames], self.qpos[frames] = qpos, integrate(qpos, step)
        for whole, limit in zip(self._limits, limits, strict=True):
            whole.take(limit, frames)

    def _evaluated(self, frames: ndarray) -> tuple[ndarray, Kinematics, ndarray, ndarray, int]:
        """What came of the last step, squared, and the goals' rows after failed frames were taken back."""
        config, objective, kin = self._config, self._objective.at(frames), kinematics(self._robot, self.qpos[frames])
        residual, jacobian, body_rows = residual_rows(objective, kin)
        actual = _squared(residual)
        failed = dilate(
            actual
            > config.failed_ratio * np.maximum(self._before[frames], self._predicted[frames]) + config.failed_residual,
            5,
        )
        if failed.any():
            self.qpos[frames[failed]] = self._last[frames[failed]]
            kin = kinematics(self._robot, self.qpos[frames])
            residual, jacobian, body_rows = residual_rows(objective, kin)
        return actual, kin, residual, jacobian, body_rows

    def _update_damping(self, frames: ndarray, actual: ndarray) -> ndarray:
        """More damping where less came true than was promised, and around there; less elsewhere."""
        before, predicted, damping = self._before[frames], self._predicted[frames], self._damping[frames]
        tried = np.isfinite(predicted)
        poor = np.zeros(len(frames), dtype=bool)
        actual, before, predicted = actual[tried], before[tried], predicted[tried]
        c = self._config
        poor[tried] = actual - predicted > c.poor_share * np.abs(before - predicted) + c.poor_residual
        grown = c.damping_growth * np.maximum(damping, c.damping_floor)
        changed = np.where(dilate(poor, 2), grown, damping / c.damping_decay)
        self._damping[frames] = np.where(tried, np.clip(changed, *c.damping_range), damping)
        return self._damping[frames]


def _near_places(
    watch: Watch, frames: ndarray, qpos: ndarray, kin: Kinematics, config: WholeClipConfig
) -> tuple[Places, ndarray, ndarray]:
    """Where soles and bodies come near to something, the gap that shall remain, and how firmly."""
    places = low_soles(kin.robot, kin, config.watched_gap).along_with(watch.near(frames, qpos))
    on_floor = (places.first == WORLD) | (places.second == WORLD)
    gap = np.where(on_floor, config.floor_gap, config.body_gap)
    return places, gap, np.where(on_floor, config.floor_spring, config.body_spring)


def _share(wanted: ndarray, largest: float) -> ndarray:
    """How much of each frame's step is taken: as little as a neighbour's, so that frames do not part."""
    from scipy.ndimage import minimum_filter1d

    return np.asarray(minimum_filter1d(np.minimum(1.0, largest / np.maximum(wanted, 1e-9)), 2 * HALF_BANDWIDTH + 1))


def _squared(residual: ndarray) -> ndarray:
    return np.square(residual).sum(axis=1)
