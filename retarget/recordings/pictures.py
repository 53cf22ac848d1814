"""A picture of a person and a robot side by side, at a few moments of one dance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy import ndarray

from clips import HumanClip, Reference, aside
from retarget.recordings.film import Bone, Stage
from robot_models import RobotModel

_MOMENTS = (0.15, 0.4, 0.65, 0.9)  # of the dance
_SIZE = 480, 560  # of one picture [pixels]
_APART = 1.1  # between person and robot [m]
_BONE, _RGBA = 0.022, np.array([0.95, 0.62, 0.2, 1.0])
_LIMBS = (
    "ankle-knee", "knee-hip", "hip-pelvis", "pelvis-neck", "neck-shoulder", "shoulder-elbow", "elbow-wrist", "ankle-toe",
)  # fmt: skip


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
        pictures.append(stage.draw(qpos, None, _bones(source, frame, qpos[:2] - beside)))
    stage.close()
    with aside(path) as unfinished:
        Image.fromarray(np.concatenate(pictures, axis=1)).save(unfinished, format="png")


def _bones(person: HumanClip, frame: int, where: ndarray) -> list[Bone]:
    """The person's limbs as capsules (from, to, radius, colour), over a place on the floor."""

    def point(name: str) -> ndarray:
        return person.point(name)[frame]

    shift = np.array([*(where - point("pelvis")[:2]), 0.0])
    bones = []
    for limb in _LIMBS:
        for side in ("left", "right"):
            ends = [f"{side}_{p}" if p not in ("pelvis", "neck") else p for p in limb.split("-")]
            if all(e in person.landmarks or e in ("pelvis", "neck") for e in ends):
                bones.append((point(ends[0]) + shift, point(ends[1]) + shift, _BONE, _RGBA))
    return bones
