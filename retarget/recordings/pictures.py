"""A picture of a person and a robot side by side, at a few moments of one dance."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clips import HumanClip, Reference, aside
from retarget.recordings.off_screen import Shot, Stage
from retarget.recordings.person import bones_of, shift_to
from robot_models import RobotModel

_MOMENTS = (0.15, 0.4, 0.65, 0.9)  # of the dance
_SIZE = 480, 560  # of one picture [pixels]
_APART = 1.1  # between person and robot [m]


def save_still(path: Path, robot: RobotModel, reference: Reference, source: HumanClip) -> None:
    """Write a PNG; the source is that of the reference's first dance.

    Raises:
        OutputError: no OpenGL on this machine, or the file cannot be written.
    """
    from PIL import Image  # comes with Rerun

    stage, first = Stage(robot, _SIZE), reference.dance.start
    pictures = []
    for share in _MOMENTS:
        frame = int(share * (source.frames - 1))
        qpos = reference.qpos[first + frame].copy()
        beside = np.array([0.0, _APART])
        stage.look_at(qpos[:2] - 0.5 * beside, max(float(qpos[2]), float(source.point("pelvis")[frame, 2])))
        pictures.append(
            stage.draw(Shot(qpos=qpos, bones=bones_of(source, frame, shift_to(source, frame, qpos[:2] - beside))))
        )
    stage.close()
    with aside(path) as unfinished:
        Image.fromarray(np.concatenate(pictures, axis=1)).save(unfinished, format="png")
