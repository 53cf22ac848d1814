"""One hand or foot brought to a place at one moment, the rest of the robot as it is: what dragging it on a page asks for."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import RobotModel

_ROUNDS, _DAMPING, _NEAR_M = 60, 0.05, 1e-4
_LONGEST = 0.2  # turn of a joint in one round [rad]


def reach(
    robot: RobotModel, qpos: Float[ndarray, "nq"], landmark: str, place_w: Float[ndarray, "3"]
) -> tuple[dict[str, float], float]:
    """The angles of the joints between trunk and landmark that bring it to a place, and how far off it stays [m].

    Damped least squares (Nakamura & Hanafusa 1986) inside the joints' limits.

    Args:
        robot: the robot.
        qpos: its pose.
        landmark: as left_wrist.
        place_w: where it shall be [m].
    """
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = qpos
    body = robot.body_ids[robot.landmark(landmark)]
    joints = _between(robot, body)
    at = [int(model.jnt_qposadr[model.joint(name).id]) for name in joints]
    dofs = [int(model.jnt_dofadr[model.joint(name).id]) for name in joints]
    low, high = (np.array([limit[robot.joint(name)] for name in joints]) for limit in (robot.lower, robot.upper))
    end, jacobian = np.array(robot.profile.ends.get(landmark, (0.0, 0.0, 0.0))), np.zeros((3, model.nv))
    off = np.inf
    for _ in range(_ROUNDS):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ end
        away = place_w - point
        off = float(np.linalg.norm(away))
        if off < _NEAR_M:
            break
        mujoco.mj_jac(model, data, jacobian, None, point, body)
        arm = jacobian[:, dofs]
        step = arm.T @ np.linalg.solve(arm @ arm.T + _DAMPING**2 * np.eye(3), away)
        data.qpos[at] = np.clip(data.qpos[at] + np.clip(step, -_LONGEST, _LONGEST), low, high)
    return dict(zip(joints, data.qpos[at].tolist(), strict=True)), off


def _between(robot: RobotModel, body: int) -> list[str]:
    """Names of the joints from a body up to the trunk, or to the root."""
    model, stop = robot.model, {robot.body_ids[robot.landmark("torso")], robot.body_ids[0]}
    joints = []
    while body not in stop and body:
        joints += [model.joint(int(model.body_jntadr[body])).name] * int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return joints[::-1]
