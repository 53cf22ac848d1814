"""Per-frame inverse kinematics with mink: one small QP per step, warm-started from the frame before.

Position limits are hard. So are speed limits, per output frame: before each frame the position bounds are cut down to
what the motors can reach from the last frame (a limit on the solver's own step would bound nothing that a robot feels).
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from retarget.config import IkConfig
from retarget.feet import FootTargets, planted_share
from retarget.targets import Targets
from robot_models import FEET, RobotModel
from robot_models.build import BODY_BIT
from robot_models.surface import touching_pairs

if TYPE_CHECKING:
    import mink

    from retarget.segment_task import SegmentTask

Progress = Callable[[int, int], None]  # frames done, frames in all


@dataclass(frozen=True, kw_only=True, eq=False)
class IkResult:
    """Configurations and how the solver fared."""

    qpos: Float[ndarray, "T nq"]
    unsolved: Int[ndarray, "N"]  # frames where the QP had no solution and the last pose was held


def follow_targets(
    robot: RobotModel,
    targets: Targets,
    config: IkConfig,
    *,
    prior: Float[ndarray, "T nq"] | None = None,
    progress: Progress | None = None,
) -> IkResult:
    """Solve every frame for all targets.

    Args:
        robot: the robot.
        targets: goals per frame.
        config: weights and iterations.
        prior: configurations to stay near where the targets leave freedom; default: the default pose.
        progress: told after every frame.
    """
    solver = _Solver(robot, config, targets.fps)
    w = config.weights
    solver.add("pelvis", w.pelvis_position, w.pelvis_orientation, targets.pelvis_pos, targets.pelvis_quat)
    solver.add("torso", 0.0, w.torso_orientation, targets.pelvis_pos, targets.torso_quat)
    for (start, end), vector in targets.limbs.items():
        solver.add_segment(start, end, w.thigh_and_shin if "hip" in start or "knee" in start else w.arm, vector)
    solver.add_feet(targets.feet)
    rest = np.broadcast_to(robot.default_qpos, (len(targets.pelvis_pos), robot.nq)) if prior is None else prior
    start = rest[0].copy()
    start[:3], start[3:7] = targets.pelvis_pos[0], targets.pelvis_quat[0]
    return solver.run(start, rest, w.posture, config.iterations, progress)


def repair_feet(
    robot: RobotModel,
    qpos: Float[ndarray, "T nq"],
    feet: FootTargets,
    fps: float,
    config: IkConfig,
    *,
    progress: Progress | None = None,
) -> IkResult:
    """Put the feet back on their targets and bodies out of one another, with as little change to `qpos` as can be."""
    solver = _Solver(robot, config, fps)
    solver.avoid(touching_pairs(robot, qpos))
    w = config.weights
    solver.add("pelvis", w.pelvis_position, w.pelvis_orientation, qpos[:, :3], qpos[:, 3:7])
    solver.add_feet(feet)
    return solver.run(qpos[0].copy(), qpos, w.repair_posture, config.repair_iterations, progress)


class _Solver:
    """mink's tasks and limits for one robot, fed frame by frame."""

    def __init__(self, robot: RobotModel, config: IkConfig, fps: float) -> None:
        import mink

        self._robot, self._config, self._fps = robot, config, fps
        model = copy.copy(robot.model)
        model.geom_conaffinity[model.geom("floor").id] |= BODY_BIT  # here bodies shall feel the floor
        self._configuration = mink.Configuration(model)
        self._limit = mink.ConfigurationLimit(model, gain=1.0)
        self._clearance: list[mink.CollisionAvoidanceLimit] = []
        self._frames: list[tuple[mink.FrameTask, ndarray, ndarray]] = []
        self._costs: dict[mink.FrameTask, ndarray] = {}  # (T, 2) position and orientation cost, frame by frame
        self._segments: list[tuple[SegmentTask, ndarray]] = []

    def add(self, landmark: str, position_cost: float, turn_cost: float, pos: ndarray, quat: ndarray) -> None:
        """A pose for the body of a landmark, frame by frame."""
        import mink

        body = self._robot.profile.landmarks[landmark]
        task = mink.FrameTask(body, "body", position_cost=position_cost, orientation_cost=turn_cost, lm_damping=0.0)
        self._frames.append((task, np.asarray(pos), np.asarray(quat)))

    def add_segment(self, start: str, end: str, cost: float, vector: ndarray) -> None:
        """A vector from one landmark's body to another's, frame by frame."""
        from retarget.segment_task import SegmentTask

        first, last = (self._robot.body_ids[self._robot.landmark(k)] for k in (start, end))
        self._segments.append((SegmentTask(first, last, cost), np.asarray(vector)))

    def add_feet(self, feet: FootTargets) -> None:
        """Goals for both feet, firm while they touch."""
        w, share = self._config.weights, planted_share(feet, self._fps)
        for k, side in enumerate(FEET):
            self.add(f"{side}_foot", w.foot_position, w.foot_orientation, feet.pos[:, k], feet.quat[:, k])
            position = w.swing_position + share[:, k] * (w.foot_position - w.swing_position)
            turn = w.swing_orientation + share[:, k] * (w.foot_orientation - w.swing_orientation)
            self._costs[self._frames[-1][0]] = np.stack((position, turn), axis=1)

    def avoid(self, pairs: list[tuple[int, int]]) -> None:
        """Keep these pairs of primitives apart: those that would touch are few, and testing all would cost most."""
        import mink

        if pairs:
            limit = mink.CollisionAvoidanceLimit(
                self._configuration.model, [([a], [b]) for a, b in pairs], gain=1.0,
                minimum_distance_from_collisions=self._config.clearance, collision_detection_distance=0.12,
            )  # fmt: skip
            self._clearance = [limit]

    def run(
        self, start: ndarray, rest: ndarray, posture_cost: float, iterations: int, progress: Progress | None
    ) -> IkResult:
        """Solve all frames from `start`, staying near `rest`."""
        import mink

        model, frames = self._robot.model, len(rest)
        cost = np.full(model.nv, posture_cost)
        cost[:6] = 0.0
        posture = mink.PostureTask(model, cost=cost)
        tasks = [*(f[0] for f in self._frames), *(s[0] for s in self._segments), posture]
        qpos, unsolved = np.zeros((frames, model.nq)), []
        self._configuration.update(self._inside(start))
        for t in range(frames):
            self._bound(qpos[t - 1] if t else None)
            posture.set_target(rest[t])
            for task, costs in self._costs.items():
                task.set_position_cost(costs[t, 0])
                task.set_orientation_cost(costs[t, 1])
            for task, pos, quat in self._frames:
                task.set_target(mink.SE3(wxyz_xyz=np.concatenate((quat[t], pos[t]))))
            for segment, vector in self._segments:
                segment.set_target(vector[t])
            steps = iterations if t else self._config.first_iterations
            if not self._solve(tasks, steps):
                unsolved.append(t)
            qpos[t] = self._inside(self._configuration.q)
            if progress is not None:
                progress(t + 1, frames)
        return IkResult(qpos=qpos, unsolved=np.array(unsolved, dtype=int))

    def _solve(self, tasks: list[object], steps: int) -> bool:
        import mink

        for _ in range(steps):
            velocity = None
            # Bodies that cannot be parted within the motors' speed are parted over the next frames instead.
            for limits in ([self._limit, *self._clearance], [self._limit]):
                try:
                    velocity = mink.solve_ik(
                        self._configuration, tasks, 1.0, "daqp", damping=self._config.damping, limits=limits
                    )
                    break
                except mink.NoSolutionFound:
                    continue
            if velocity is None:
                return False
            self._configuration.integrate_inplace(velocity, 1.0)
            if np.abs(velocity).max() < 1e-6:
                break
        return True

    def _bound(self, last: ndarray | None) -> None:
        """Position bounds of this frame: the joint limits, and what the motors can reach from the last frame."""
        lower, upper = self._ranges()
        if last is not None:
            step = self._config.velocity_share * self._robot.velocity / self._fps
            lower, upper = np.maximum(lower, last[7:] - step), np.minimum(upper, last[7:] + step)
        self._limit.lower[7:], self._limit.upper[7:] = lower, upper

    def _ranges(self) -> tuple[ndarray, ndarray]:
        margin = np.minimum(self._config.limit_margin, 0.1 * (self._robot.upper - self._robot.lower))
        return self._robot.lower + margin, self._robot.upper - margin

    def _inside(self, qpos: ndarray) -> ndarray:
        """The same configuration with its joints inside the current bounds: rounding may leave them 1e-9 beyond."""
        q = np.array(qpos)
        q[7:] = np.clip(q[7:], *self._ranges())
        return q
