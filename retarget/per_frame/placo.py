"""A per-frame stream on placo: touching feet are hard tasks, everything else is weighed against them."""

from __future__ import annotations

import numpy as np
import placo
from jaxtyping import Float
from numpy import ndarray

from clips import FREE
from retarget.config import IkConfig
from retarget.errors import RetargetError
from retarget.per_frame.base import reachable
from retarget.targets import Targets
from robot_models import FEET, RobotModel, urdf_link, urdf_text
from robot_models.maths import rotation as rot


class PlacoIk:
    """Position limits are hard; the motors' speeds are kept per output frame by clipping."""

    def __init__(self, robot: RobotModel, config: IkConfig, fps: float) -> None:
        self._robot, self._config, self._fps = robot, config, fps
        self._model = placo.RobotWrapper("", placo.Flags.ignore_collisions, urdf_text(robot))
        self._solver = placo.KinematicsSolver(self._model)
        self._solver.enable_joint_limits(True)
        if robot.profile.ends:
            raise RetargetError(
                f"robot '{robot.name}' with solver placo", found=f"no body at {', '.join(robot.profile.ends)}",
                expected="a body at every wrist", option="solver", suggestion="whole-clip",
            )  # fmt: skip
        body = {landmark: urdf_link(robot, name) for landmark, name in robot.profile.landmarks.items()}
        self._pelvis = self._solver.add_frame_task(body["pelvis"], np.eye(4))
        self._pelvis.configure("pelvis", "soft", config.pelvis_position**2, config.pelvis_orientation**2)
        self._torso = self._solver.add_orientation_task(body["torso"], np.eye(3))
        self._torso.configure("torso", "soft", config.torso_orientation**2)
        self._feet = [self._solver.add_frame_task(body[f"{side}_foot"], np.eye(4)) for side in FEET]
        self._limbs = {}
        for side in FEET:
            for start, end in (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "wrist")):
                task = self._solver.add_position_task(body[f"{side}_{end}"], np.zeros(3))
                task.configure(f"{side}_{end}", "soft", (config.leg if start in ("hip", "knee") else config.arm) ** 2)
                self._limbs[f"{side}_{start}", f"{side}_{end}"] = task
        self._posture = self._solver.add_joints_task()
        self._posture.configure("posture", "soft", config.posture**2)
        self._solver.add_regularization_task(config.damping)
        self._last: ndarray | None = None

    def _set_joints(self, angles: Float[ndarray, "J"]) -> None:
        for name, angle in zip(self._robot.joint_names, angles, strict=True):
            self._model.set_joint(name, angle)

    def __call__(self, targets: Targets, posture: Float[ndarray, "J"]) -> Float[ndarray, "nq"]:
        """One frame; where the QP has no solution the pose is held."""
        config, model, names, first = self._config, self._model, self._robot.joint_names, self._last is None
        if first:
            model.set_T_world_frame(
                urdf_link(self._robot, self._robot.profile.root), _pose(targets.pelvis_pos[0], targets.pelvis_quat[0])
            )
            self._set_joints(self._robot.default_joint_pos)
        self._posture.set_joints(dict(zip(names, posture, strict=True)))
        self._pelvis.T_world_frame = _pose(targets.pelvis_pos[0], targets.pelvis_quat[0])
        self._torso.R_world_frame = rot.to_matrix(targets.torso_quat[0])
        self._aim_feet(targets, soft=first)
        for _ in range(config.first_iterations if first else config.iterations):
            model.update_kinematics()
            for (start, _end), task in self._limbs.items():
                origin = model.get_T_world_frame(urdf_link(self._robot, self._robot.profile.landmarks[start]))[:3, 3]
                task.target_world = origin + targets.limbs[start, _end][0]
            try:
                self._solver.solve(True)
            except RuntimeError:
                self._aim_feet(targets, soft=True)  # hard tasks that contradict the limits
        model.update_kinematics()
        joints = np.array([model.get_joint(name) for name in names])
        joints = np.clip(joints, *reachable(self._robot, self._last, config, self._fps))
        self._set_joints(joints)
        self._last = joints
        root = model.get_T_world_frame(urdf_link(self._robot, self._robot.profile.root))
        return np.concatenate((root[:3, 3], rot.from_matrix(root[None, :3, :3])[0], joints))

    def _aim_feet(self, targets: Targets, *, soft: bool) -> None:
        config, feet = self._config, targets.feet
        for k, (side, task) in enumerate(zip(FEET, self._feet, strict=True)):
            down = (feet.contact[0, 2 * k : 2 * k + 2] != FREE).any()
            position, turn = (config.planted, config.planted_turn) if down else (config.swing, config.swing_turn)
            task.configure(f"{side}_sole", "hard" if down and not soft else "soft", position**2, turn**2)
            task.T_world_frame = _pose(feet.pos[0, k], feet.quat[0, k])


def _pose(pos: ndarray, quat: ndarray) -> Float[ndarray, "4 4"]:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rot.to_matrix(quat), pos
    return out
