"""Joints that no goal asks anything of: they turn a hand or a head. A firm posture keeps them from wandering."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Bool
from numpy import ndarray

from robot_models import FEET, RobotModel, ancestors, joint_axes

_LEVER = 0.3  # of the forearm's length: a joint that swings the wrist by less only turns the hand


@lru_cache(maxsize=16)
def free_joints(robot: RobotModel) -> Bool[ndarray, "J"]:
    """Which joints carry no trunk, knee, foot or elbow, and swing no wrist."""
    pos, _, axes, anchors = (a[0] for a in joint_axes(robot, robot.zero_qpos[None]))
    carried, at = ancestors(robot), robot.landmark
    needed = carried[at("torso")].copy()
    for side in FEET:
        foot, elbow, wrist = at(f"{side}_foot"), at(f"{side}_elbow"), at(f"{side}_wrist")
        lever = np.linalg.norm(np.cross(axes, pos[wrist] - anchors), axis=1)
        swings = lever > _LEVER * np.linalg.norm(pos[wrist] - pos[elbow])
        needed |= carried[foot] | carried[elbow] | (carried[wrist] & swings)
    return ~needed
