"""Arms that end at the elbow: where their wrists are; and a second opinion on every limb."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.draft.estimates import UnprofiledModel
from robot_models.profile import FEET

if TYPE_CHECKING:
    import mujoco

_FOREARM_M = 0.08  # a wrist that is nearer to its elbow than this is none [m]
_WRIST = 0.75  # of the way from elbow to fingertips
_UNEVEN = 2.0  # ratio of a limb's two halves that is doubted


def find_ends(
    unprofiled: UnprofiledModel, points: Mapping[str, Float[ndarray, "V 3"]]
) -> tuple[dict[str, tuple[float, float, float]], list[str]]:
    """Where wrists are that have no body of their own, in the forearm's frame, and what is said about them."""
    model, data, marks = unprofiled.model, unprofiled.data, unprofiled.landmarks
    ends: dict[str, tuple[float, float, float]] = {}
    notes = []
    for side in FEET:
        shoulder, elbow, wrist = (data.body(marks[f"{side}_{part}"]) for part in ("shoulder", "elbow", "wrist"))
        forearm, upper = (float(np.linalg.norm(b.xpos - a.xpos)) for a, b in ((elbow, wrist), (shoulder, elbow)))
        if forearm > max(_FOREARM_M, upper / _UNEVEN):
            continue
        end, told = _beyond_the_elbow(model, int(wrist.id), points.get(wrist.name))
        x, y, z = (round(float(v), 4) for v in end)
        ends[f"{side}_wrist"] = x, y, z
        notes.append(f"ends.{side}_wrist: '{wrist.name}' ends at the elbow; its wrist is {told}")
    return ends, notes


def _beyond_the_elbow(
    model: mujoco.MjModel, body: int, surface: Float[ndarray, "V 3"] | None
) -> tuple[Float[ndarray, "3"], str]:
    """Where the wrist of an arm that ends with a body is, in that body's frame, and how that is known."""
    hands = [b for b in range(model.nbody) if model.body_parentid[b] == body and not model.body_jntnum[b]]
    places = [np.array(model.body_pos[b]) for b in hands if np.linalg.norm(model.body_pos[b]) > _FOREARM_M]
    if places:
        return max(places, key=lambda p: float(np.linalg.norm(p))), "the hand that is welded to it"
    if surface is not None:
        far = np.linalg.norm(surface, axis=1)
        return _WRIST * surface[far > 0.9 * far.max()].mean(axis=0), "most of the way to its surface's far end"
    return 2.0 * np.array(model.body_ipos[body]), "twice as far as its centre of mass: it has no surface"


def doubted_limbs(unprofiled: UnprofiledModel, ends: Mapping[str, tuple[float, float, float]]) -> list[str]:
    """A second opinion on knees and elbows: both halves of a limb are about as long as each other."""
    data, marks, notes = unprofiled.data, unprofiled.landmarks, []

    def at(name: str) -> Float[ndarray, "3"]:
        body = data.body(marks[name])
        return np.asarray(body.xpos + body.xmat.reshape(3, 3) @ np.array(ends.get(name, (0.0, 0.0, 0.0))))

    for side in FEET:
        for parts in (("hip", "knee", "foot"), ("shoulder", "elbow", "wrist")):
            first, middle, last = (at(f"{side}_{part}") for part in parts)
            upper, lower = float(np.linalg.norm(middle - first)), float(np.linalg.norm(last - middle))
            ratio = lower / max(1e-6, upper)
            if not 1.0 / _UNEVEN < ratio < _UNEVEN:
                notes.append(
                    f"landmarks: from {side} {parts[1]} to {parts[2]} is {ratio:.1f} times as far as from {parts[0]} to {parts[1]}:"
                    " is that joint the right one?"
                )
    return notes
