"""Which edges carry although they move: where nothing stands and the body does not fall, the lowest of the feet hold it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import FREE
from retarget.config import GlideConfig
from retarget.dynamics.floor_points import carrying_points, layout_of, placed_soles
from retarget.dynamics.momentum_rate import momentum_rate
from robot_models import CONTACT_NAMES, RobotModel, kinematics
from robot_models.maths import close_gaps


def gliding_edges(
    robot: RobotModel,
    qpos: Float[ndarray, "T nq"],
    contact: Int[ndarray, "T 4"],
    airborne: Bool[ndarray, "T"],
    fps: float,
    config: GlideConfig = GlideConfig(),
) -> Bool[ndarray, "T 4"]:
    """Sole edges that have to carry in frames where none stands, for the body does not fall.

    Args:
        robot: the robot.
        qpos: its motion.
        contact: what the edges do so far.
        airborne: frames of jumps.
        fps: of the motion.
        config: how low, and for how much weight.
    """
    kin = kinematics(robot, qpos)
    demand = momentum_rate(kin, qpos, 1.0 / fps).demand
    lift = demand.force_w[:, 2] / demand.weight
    points, _ = placed_soles(robot, kin.pos, kin.quat)
    edge = np.array(layout_of(robot).edge)
    height = np.stack([points[:, edge == k, 2].max(axis=1) for k in range(len(CONTACT_NAMES))], axis=1)
    alone = ~carrying_points(robot, kin.pos, kin.quat, contact, fps).any
    low = (height < height.min(axis=1, keepdims=True) + config.level) & (height < config.height)
    glides = (alone & (lift > config.carried))[:, None] & low & (contact == FREE)
    shortest = max(1, round(config.gap_s * fps))
    closed = np.stack([close_gaps(glides[:, k], shortest) for k in range(4)], axis=1)
    return closed & (contact == FREE) & ~airborne[:, None]
