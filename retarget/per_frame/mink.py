"""A per-frame stream on mink: one small QP per step, warm-started from the frame before."""

from __future__ import annotations

import mink
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import FREE
from retarget.config import IkConfig
from retarget.per_frame.base import reachable
from retarget.per_frame.segment_task import SegmentTask
from retarget.targets import Targets
from robot_models import FEET, RobotModel


class MinkIk:
    """Position limits are hard, and so are the motors' speeds, per output frame."""

    def __init__(self, robot: RobotModel, config: IkConfig, fps: float) -> None:
        self._robot, self._config, self._fps = robot, config, fps
        body, model = robot.profile.landmarks, robot.model
        self._configuration = mink.Configuration(model)
        self._limit = mink.ConfigurationLimit(model, gain=1.0)
        self._pelvis = mink.FrameTask(body["pelvis"], "body", config.pelvis_position, config.pelvis_orientation)
        self._torso = mink.FrameTask(body["torso"], "body", 0.0, config.torso_orientation)
        self._feet = [mink.FrameTask(body[f"{side}_foot"], "body", config.swing, config.swing_turn) for side in FEET]
        self._limbs: dict[tuple[str, str], SegmentTask] = {}
        self._posture = mink.PostureTask(
            model, cost=np.concatenate((np.zeros(6), np.full(model.nv - 6, config.posture)))
        )
        self._last: ndarray | None = None

    def __call__(self, targets: Targets, posture: Float[ndarray, "J"]) -> Float[ndarray, "nq"]:
        """One frame; where the QP has no solution the pose is held."""
        config, first = self._config, self._last is None
        if first:
            start = np.concatenate((targets.pelvis_pos[0], targets.pelvis_quat[0], self._robot.default_joint_pos))
            self._configuration.update(start)
        tasks = [*self._aimed(targets), self._posture]
        self._posture.set_target(np.concatenate((targets.pelvis_pos[0], targets.pelvis_quat[0], posture)))
        lower, upper = reachable(self._robot, self._last, config, self._fps)
        self._limit.lower[7:], self._limit.upper[7:] = lower, upper
        for _ in range(config.first_iterations if first else config.iterations):
            try:
                step = mink.solve_ik(
                    self._configuration, tasks, 1.0, "daqp", damping=config.damping, limits=[self._limit]
                )
            except mink.NoSolutionFound:
                break
            self._configuration.integrate_inplace(step, 1.0)
            if np.abs(step).max() < 1e-6:
                break
        qpos = np.array(self._configuration.q)
        qpos[7:] = np.clip(qpos[7:], lower, upper)  # rounding may leave a joint 1e-9 beyond
        self._last = qpos[7:]
        return qpos

    def _aimed(self, targets: Targets) -> list[mink.Task]:
        config, feet = self._config, targets.feet
        self._pelvis.set_target(_pose(targets.pelvis_pos[0], targets.pelvis_quat[0]))
        self._torso.set_target(_pose(targets.pelvis_pos[0], targets.torso_quat[0]))
        for k, task in enumerate(self._feet):
            down = (feet.contact[0, 2 * k : 2 * k + 2] != FREE).any()
            task.set_position_cost(config.planted if down else config.swing)
            task.set_orientation_cost(config.planted_turn if down else config.swing_turn)
            task.set_target(_pose(feet.pos[0, k], feet.quat[0, k]))
        for limb, vector in targets.limbs.items():
            if limb not in self._limbs:
                start, end = (self._robot.body_ids[self._robot.landmark(name)] for name in limb)
                beyond = self._robot.profile.ends.get(limb[1], (0.0, 0.0, 0.0))
                leg = limb[0].endswith(("hip", "knee"))
                self._limbs[limb] = SegmentTask(start, end, self._config.leg if leg else self._config.arm, beyond)
            self._limbs[limb].set_target(vector[0])
        return [self._pelvis, self._torso, *self._feet, *self._limbs.values()]


def _pose(pos: ndarray, quat: ndarray) -> mink.SE3:
    return mink.SE3(wxyz_xyz=np.concatenate((quat, pos)))
