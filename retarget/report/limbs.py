"""How far the limbs of two motions are apart."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference
from retarget.targets import LIMBS
from robot_models import RobotModel
from robot_models.maths import rotation as rot


def limb_angles(
    first: Reference, robot: RobotModel, second: Reference, other: RobotModel
) -> dict[str, Float[ndarray, "T"]]:
    """The angle between each limb's directions in two motions [deg], frame by frame, as far as the shorter one lasts.

    Both begin with their dances, at one frame rate; the second is turned so that its pelvis heads as the first's does there.

    Args:
        first: a motion.
        robot: its robot.
        second: another motion, of any robot.
        other: its robot.
    """
    frames = min(first.dance.stop - first.dance.start, second.dance.stop - second.dance.start)
    here, there = (slice(r.dance.start, r.dance.start + frames) for r in (first, second))
    heading = [
        float(rot.yaw(r.body_quat_w[r.dance.start, None, model.landmark("pelvis")])[0])
        for r, model in ((first, robot), (second, other))
    ]
    turn = rot.from_yaw(np.array(heading[0] - heading[1]))
    angles = {}
    for start, end in LIMBS:
        a, b = (
            np.diff(model.landmark_pos((start, end), r.body_pos_w[frames_of], r.body_quat_w[frames_of]), axis=1)[:, 0]
            for r, model, frames_of in ((first, robot, here), (second, other, there))
        )
        b = rot.rotate(np.broadcast_to(turn, (frames, 4)), b)
        cosine = np.clip(np.sum(rot.unit(a) * rot.unit(b), axis=-1), -1.0, 1.0)
        angles[f"{start} to {end}".replace("_", " ")] = np.degrees(np.arccos(cosine))
    return angles
