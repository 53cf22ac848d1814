"""Knees, hands, elbows, seat and shoulders of a person that are on the floor: how high the robot's shall be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import HumanClip, own_floor
from retarget.config import PartsConfig
from retarget.targets.contacts import heel_toe_points
from retarget.targets.feet import smoothstep
from robot_models import FEET, RobotModel

_THICK = {"knee": 0.08, "wrist": 0.06, "elbow": 0.06, "shoulder": 0.10}  # of a person, from the joint to the floor [m]
_SEAT = 0.10


@dataclass(frozen=True, kw_only=True, eq=False)
class FloorParts:
    """Parts of the robot that come near the floor: T frames, P parts; P is 0 for a dance on its feet."""

    height: Float[ndarray, "T P"]  # of their lowest points [m]
    share: Float[ndarray, "T P"]  # 1 on the floor, 0 well over it
    body: Int[ndarray, "T P"]  # place in `body_names`

    def at(self, frames: Int[ndarray, "F"]) -> FloorParts:
        """Some of the frames."""
        return FloorParts(**{f.name: getattr(self, f.name)[frames] for f in fields(self)})


def join_parts(parts: Sequence[FloorParts]) -> FloorParts:
    """One after the other."""
    most = max(p.share.shape[1] for p in parts)
    wide = {
        f.name: [np.pad(getattr(p, f.name), ((0, 0), (0, most - p.share.shape[1]))) for p in parts]
        for f in fields(FloorParts)
    }
    return FloorParts(**{name: np.concatenate(arrays) for name, arrays in wide.items()})


def no_parts(frames: int) -> FloorParts:
    """Of a motion on its feet."""
    nothing = np.zeros((frames, 0))
    return FloorParts(height=nothing, share=nothing, body=nothing.astype(int))


def floor_parts(clip: HumanClip, robot: RobotModel, scale: float, config: PartsConfig) -> FloorParts:
    """Find them by their heights over the floor of the feet; the thickness of flesh is taken off."""
    floor = float(own_floor(heel_toe_points(clip)).min())
    thick = {"pelvis": _SEAT} | {f"{side}_{part}": t for side in FEET for part, t in _THICK.items()}
    heights, shares, bodies = [], [], []
    for name, flesh in thick.items():
        over = clip.point(name)[:, 2] - floor
        over = np.maximum(over - min(float(np.percentile(over, 1.0)), config.most_flesh * flesh), 0.0)
        share = smoothstep(1.0 - over / config.reach)
        if (share > 0.0).any():
            heights.append(scale * over)
            shares.append(share)
            bodies.append(robot.landmark(name))
    if not bodies:
        return no_parts(clip.frames)
    body = np.broadcast_to(np.array(bodies), (clip.frames, len(bodies)))
    return FloorParts(height=np.stack(heights, axis=1), share=np.stack(shares, axis=1), body=body)
