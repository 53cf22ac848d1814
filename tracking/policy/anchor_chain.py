"""The way from a robot's root body, where its IMU is, to the body that a policy is anchored at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robot_models import RobotModel
from robot_models.maths import rotation as rot
from tracking.policy.contract import ChainLink


def anchor_chain(robot: RobotModel, anchor: str, joints: Sequence[str] | None = None) -> tuple[ChainLink, ...]:
    """Bodies and joints from the root to the anchor.

    Args:
        robot: the robot.
        anchor: name of the body.
        joints: those that the policy knows, by default all; the others stand at the default pose.
    """
    m, links = robot.model, []
    body, root = robot.body_ids[robot.body(anchor)], robot.body_ids[0]
    while body != root:
        quat, axis, joint = np.array(m.body_quat[body]), np.zeros(3), None
        if m.body_jntnum[body]:
            at = int(m.body_jntadr[body])
            axis, joint = np.array(m.jnt_axis[at]), m.joint(at).name
            if joints is not None and joint not in joints:
                rest = robot.default_joint_pos[robot.joint(joint)]
                quat, axis, joint = rot.multiply(quat, rot.exp(rest * axis)), np.zeros(3), None
        links.append(
            ChainLink(
                pos=tuple(m.body_pos[body].tolist()), quat=tuple(quat.tolist()), joint=joint, axis=tuple(axis.tolist())
            )
        )
        body = int(m.body_parentid[body])
    return tuple(reversed(links))
