"""Gymnasium's ids of this project: `import tracking.envs`, or `gymnasium.make("tracking.envs:DanceTracking-v0", ...)`."""

from __future__ import annotations

import gymnasium

gymnasium.register(id="DanceTracking-v0", entry_point="tracking.gym_env:DanceTrackingEnv")
gymnasium.register(id="DanceEnv-v0", entry_point="tracking.dance_env:DanceEnv")
