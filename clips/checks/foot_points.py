"""Where the feet and the pelvis of a recording are: of a person by its points, of a robot by forward kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip, RobotClip, full_qpos
from robot_models import forward_kinematics, load_robot, sole_corners
from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True, eq=False)
class FootPoints:
    """Points of both feet, and what stands over them. World, z up [m]."""

    points: Float[ndarray, "T 2 K 3"]  # left and right; ankle and toe, or the heel and toe edges of a robot's soles
    pelvis: Float[ndarray, "T 3"]
    left: Float[ndarray, "T 3"]  # the body's own left, a unit vector
    up: Float[ndarray, "T 3"]  # the body's own up, a unit vector
    leg: float  # from hip to ankle, stretched [m]


@lru_cache(maxsize=1)  # every check of a clip asks for them
def foot_points(clip: Clip) -> FootPoints:
    """The feet of any recording."""
    return _of_person(clip) if isinstance(clip, HumanClip) else _of_robot(clip)


def _of_person(clip: HumanClip) -> FootPoints:
    hips, shoulders, ankles = (
        [clip.point(f"{side}_{part}") for side in ("left", "right")] for part in ("hip", "shoulder", "ankle")
    )
    parts = [p for p in ("ankle", "toe") if {f"left_{p}", f"right_{p}"} <= set(clip.landmarks)]
    feet = [np.stack([clip.point(f"{side}_{p}") for p in parts], axis=1) for side in ("left", "right")]
    return FootPoints(
        points=np.stack(feet, axis=1),
        pelvis=clip.point("pelvis"),
        left=rot.unit(rot.unit(hips[0] - hips[1]) + rot.unit(shoulders[0] - shoulders[1])),
        up=rot.unit(hips[0] + hips[1] + shoulders[0] + shoulders[1] - 2.0 * (ankles[0] + ankles[1])),
        leg=clip.leg_length,
    )


def _of_robot(clip: RobotClip) -> FootPoints:
    robot = load_robot(clip.robot)
    corners = sole_corners(robot, *forward_kinematics(robot, full_qpos(clip, robot)))
    heels_toes = np.stack((corners[:, :, :2].mean(axis=2), corners[:, :, 2:].mean(axis=2)), axis=2)
    axes = np.broadcast_to(np.eye(3), (clip.frames, 3, 3))
    return FootPoints(
        points=heels_toes,
        pelvis=clip.root_pos,
        left=rot.rotate(clip.root_quat, axes[:, 1]),
        up=rot.rotate(clip.root_quat, axes[:, 2]),
        leg=float(robot.default_qpos[2]),
    )
