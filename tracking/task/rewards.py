"""Rewards of the tracking task: pure functions of errors, each logged alone, each at most its weight.

With perfect tracking every exponential is 1 and every penalty 0, so the sum is at its maximum.
"""

from __future__ import annotations

from jaxtyping import Float

from robot_models.maths import Array, array_namespace
from tracking.config import RewardConfig
from tracking.task.tracking_errors import TrackingErrors

Reward = Float[Array, "N"]


def closeness(squared: Float[Array, "N"], width: float) -> Reward:
    """exp(-e^2 / sigma^2) (Peng et al. 2018, eq. 5, in BeyondMimic's form)."""
    return array_namespace(squared).exp(-squared / width**2)


def mean_square(vectors: Float[Array, "N K 3"]) -> Float[Array, "N"]:
    """Mean over bodies of the squared length."""
    return (vectors * vectors).sum(axis=-1).mean(axis=-1)


def action_rate(action: Float[Array, "N J"], last_action: Float[Array, "N J"]) -> Float[Array, "N"]:
    """Squared change of the action, summed over joints."""
    change = action - last_action
    return (change * change).sum(axis=-1)


def beyond_soft_limits(
    joint_pos: Float[Array, "N J"], lower: Float[Array, "J"], upper: Float[Array, "J"], share: float
) -> Float[Array, "N"]:
    """Radians outside the middle `share` of the joint ranges, summed over joints."""
    middle, half = 0.5 * (lower + upper), 0.5 * share * (upper - lower)
    xp = array_namespace(joint_pos)
    return xp.clip(xp.abs(joint_pos - middle) - half, 0.0, None).sum(axis=-1)


def reward_terms(
    errors: TrackingErrors,
    action: Float[Array, "N J"],
    last_action: Float[Array, "N J"],
    over_limits: Float[Array, "N"],
    config: RewardConfig,
) -> dict[str, Reward]:
    """Every weighted term by name; their sum is the reward per second."""
    c = config
    return {
        "anchor_position": c.anchor_position * closeness((errors.anchor_pos**2).sum(axis=-1), c.anchor_position_width),
        "anchor_orientation": c.anchor_orientation * closeness(errors.anchor_angle**2, c.anchor_orientation_width),
        "body_position": c.body_position * closeness(mean_square(errors.body_pos), c.body_position_width),
        "body_orientation": c.body_orientation
        * closeness((errors.body_angle**2).mean(axis=-1), c.body_orientation_width),
        "body_linear_velocity": c.body_linear_velocity
        * closeness(mean_square(errors.body_lin_vel), c.body_linear_velocity_width),
        "body_angular_velocity": c.body_angular_velocity
        * closeness(mean_square(errors.body_ang_vel), c.body_angular_velocity_width),
        "action_rate": c.action_rate * action_rate(action, last_action),
        "joint_limit": c.joint_limit * over_limits,
    }
