"""A dance slowed where the robot's body cannot do it: physics asks for a quarter of the force at half the pace.

Only the stretches that need it are slowed. A flight keeps its duration: slower, it would have to rise higher.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import Clip, repair, warp_time
from clips.edit import recentre, resample
from retarget.config import RetargetConfig
from retarget.errors import RetargetError
from retarget.pipeline import Retargeted, retarget
from robot_models import RobotModel
from robot_models.maths import Progress, silent, smooth


@dataclass(frozen=True, kw_only=True)
class FitConfig:
    """How far a dance may be slowed."""

    rounds: int = 4
    slowest: float = 0.6  # of the pace before, per round
    margin_s: float = 0.15  # slowed on both sides of a hard frame [s]
    aim: float = 0.8  # score that a slowed stretch shall reach
    smooth_hz: float = 1.5  # how fast the pace may change [Hz]


def fit_to_dynamics(
    clip: Clip,
    robot: RobotModel,
    config: RetargetConfig | None = None,
    fit: FitConfig | None = None,
    *,
    progress: Progress = silent,
) -> Retargeted:
    """Retarget, find what physics does not allow, slow the source there, and again; the best round is kept.

    Every change of pace stands among the conversions of the result's source.

    Raises:
        RetargetError: Pinocchio is not installed; DanceError as for `retarget`.
    """
    config, fit = config or RetargetConfig(), fit or FitConfig()
    recorded = recentre(resample(repair(clip), config.fps))
    best: tuple[float, Retargeted] | None = None
    for _ in range(fit.rounds):
        result = retarget(recorded, robot, config, progress=progress)
        if result.dynamics is None:
            raise RetargetError(
                "fit to dynamics", found="no Pinocchio", expected="pin 3.8.0", cure="pip install pin==3.8.0"
            )
        score = result.dynamics.score[result.reference.dance]
        share = float((score >= 1.0).mean())
        if best is None or share < best[0]:
            best = share, result
        if share == 0.0:
            break
        flight = result.dynamics.flight[result.reference.dance]
        recorded = warp_time(recorded, pace_for(score, flight, config.fps, fit))
    assert best is not None
    return best[1]


def pace_for(score: Float[ndarray, "T"], flight: Bool[ndarray, "T"], fps: float, fit: FitConfig) -> Float[ndarray, "T"]:
    """The pace at which every frame's score comes down to the aim, if it were all acceleration: score ~ pace^2."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    reach = 2 * max(1, round(fit.margin_s * fps)) + 1
    wanted = np.where(score >= 1.0, np.sqrt(fit.aim / np.maximum(score, 1e-9)), 1.0)
    pace = minimum_filter1d(np.maximum(wanted, fit.slowest), reach)
    # A longer filter first, so that smoothing does not fill the dip again.
    pace = smooth(minimum_filter1d(pace, reach), fps, fit.smooth_hz)
    in_air = maximum_filter1d(flight.astype(float), reach) > 0.5
    return np.where(in_air, 1.0, np.clip(pace, fit.slowest, 1.0))
