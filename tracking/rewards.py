"""Rewards of the tracking task: pure functions of errors, each logged alone, each at most its weight.

With perfect tracking every exponential is 1 and every penalty 0, so the sum is at its maximum.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from tracking.comparison import TrackingErrors
from tracking.config import RewardConfig

Reward = Float[ndarray, "N"]


def closeness(squared: Float[ndarray, "N"], width: float) -> Reward:
    """exp(-e^2 / sigma^2) (Peng et al. 2018, eq. 5, in BeyondMimic's form)."""
    return np.exp(-squared / width**2)


def mean_square(vectors: Float[ndarray, "N K 3"]) -> Float[ndarray, "N"]:
    """Mean over bodies of the squared length."""
    return np.asarray(np.square(vectors).sum(axis=-1).mean(axis=-1))


def action_rate(action: Float[ndarray, "N J"], last_action: Float[ndarray, "N J"]) -> Float[ndarray, "N"]:
    """Squared change of the action, summed over joints."""
    return np.asarray(np.square(action - last_action).sum(axis=-1))


def beyond_soft_limits(
    joint_pos: Float[ndarray, "N J"], lower: Float[ndarray, "J"], upper: Float[ndarray, "J"], share: float
) -> Float[ndarray, "N"]:
    """Radians outside the middle `share` of the joint ranges, summed over joints."""
    middle, half = 0.5 * (lower + upper), 0.5 * share * (upper - lower)
    return np.asarray(np.maximum(np.abs(joint_pos - middle) - half, 0.0).sum(axis=-1))


def reward_terms(
    errors: TrackingErrors,
    action: Float[ndarray, "N J"],
    last_action: Float[ndarray, "N J"],
    over_limits: Float[ndarray, "N"],
    config: RewardConfig,
) -> dict[str, Reward]:
    """Every weighted term by name; their sum is the reward per second."""
    c = config
    return {
        "anchor_position": c.anchor_position
        * closeness(np.square(errors.anchor_pos).sum(axis=-1), c.anchor_position_width),
        "anchor_orientation": c.anchor_orientation
        * closeness(np.square(errors.anchor_angle), c.anchor_orientation_width),
        "body_position": c.body_position * closeness(mean_square(errors.body_pos), c.body_position_width),
        "body_orientation": c.body_orientation
        * closeness(np.square(errors.body_angle).mean(axis=-1), c.body_orientation_width),
        "body_linear_velocity": c.body_linear_velocity
        * closeness(mean_square(errors.body_lin_vel), c.body_linear_velocity_width),
        "body_angular_velocity": c.body_angular_velocity
        * closeness(mean_square(errors.body_ang_vel), c.body_angular_velocity_width),
        "action_rate": c.action_rate * action_rate(action, last_action),
        "joint_limit": c.joint_limit * over_limits,
    }
