"""A person as a figure of bones, in films and pictures."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import HumanClip
from retarget.recordings.off_screen import Bone

_BONE, _RGBA = 0.022, np.array([0.95, 0.62, 0.2, 1.0])
_LIMBS = (
    "ankle-knee", "knee-hip", "hip-pelvis", "pelvis-neck", "neck-shoulder", "shoulder-elbow", "elbow-wrist", "ankle-toe",
    "neck-head",
)  # fmt: skip
_MIDDLE = ("pelvis", "neck", "head")


def shift_to(person: HumanClip, frame: int, place: Float[ndarray, "2"]) -> Float[ndarray, "3"]:
    """What moves the person's pelvis at a frame over a place on the floor [m]."""
    return np.array([*(place - person.point("pelvis")[frame, :2]), 0.0])


def bones_of(person: HumanClip, frame: int, shift: Float[ndarray, "3"]) -> list[Bone]:
    """The person's limbs at a frame as capsules, moved by a shift [m]."""
    bones = []
    for limb in _LIMBS:
        for side in ("left", "right"):
            ends = [f"{side}_{p}" if p not in _MIDDLE else p for p in limb.split("-")]
            if all(e in person.landmarks or e in ("pelvis", "neck") for e in ends):
                start, end = (person.point(e)[frame] + shift for e in ends)
                bones.append((start, end, _BONE, _RGBA))
    return bones
