"""Gymnasium's ids of this project: `import tracking.envs`, or `gymnasium.make("tracking.envs:DanceTracking-v0", ...)`."""

import gymnasium

from tracking.envs.dance_env import DanceEnv
from tracking.envs.tracking_env import DanceTrackingEnv

gymnasium.register(id="DanceTracking-v0", entry_point="tracking.envs:DanceTrackingEnv")
gymnasium.register(id="DanceEnv-v0", entry_point="tracking.envs:DanceEnv")

__all__ = [
    "DanceEnv",
    "DanceTrackingEnv",
]
