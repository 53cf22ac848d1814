"""Capsules along the limbs of a robot whose surface nobody has: as thick as the limbs of humanoids are."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.draft.estimates import UnprofiledModel
from robot_models.draft.stance import Sole
from robot_models.profile import FEET, Capsule

# Radii over the length of the leg, as G1, H1, R1 and T1 have them by their meshes.
_THICK = {
    "thigh": 0.065,
    "shank": 0.045,
    "upper_arm": 0.045,
    "forearm": 0.04,
    "trunk": 0.1,
    "pelvis": 0.08,
    "head": 0.095,
}
_PARTS = (
    ("thigh", "hip", "knee"),
    ("shank", "knee", "foot"),
    ("upper_arm", "shoulder", "elbow"),
    ("forearm", "elbow", "wrist"),
)
_STUB = 0.6  # of its limb's length, below which a capsule does not stand for the limb
_NECK = 0.2  # from the shoulders to the middle of the head, over the length of the leg
_FOOT = 0.012  # radius along the edges of a sole [m]


def limb_capsules(
    unprofiled: UnprofiledModel,
    soles: Mapping[str, Sole],
    ends: Mapping[str, tuple[float, float, float]],
    bare: Collection[str],
) -> list[Capsule]:
    """One along every half of a limb, one in trunk and pelvis, a head, two along every sole, of bodies without a surface.

    Args:
        unprofiled: the robot at zero.
        soles: of both feet.
        ends: where wrists are that have no body of their own, in the frame of their landmark's body.
        bare: bodies that have no shape; others get none.
    """
    data, marks = unprofiled.data, unprofiled.landmarks

    def at(mark: str) -> Float[ndarray, "3"]:
        body = data.body(marks[mark])
        return np.asarray(body.xpos + body.xmat.reshape(3, 3) @ np.array(ends.get(mark, (0.0, 0.0, 0.0))))

    leg = sum(float(np.linalg.norm(at(f"left_{a}") - at(f"left_{b}"))) for a, b in (("hip", "knee"), ("knee", "foot")))
    found = []
    for side in FEET:
        for part, start, end in _PARTS:
            first, last = at(f"{side}_{start}"), at(f"{side}_{end}")
            body = _carrier(unprofiled, marks[f"{side}_{start}"], marks[f"{side}_{end}"])
            found.append(_along(unprofiled, f"{side}_{part}", body, first, last, _THICK[part] * leg))
        (x0, x1), (y0, y1), z = soles[side]
        for edge, y in (("right", y0 + _FOOT), ("left", y1 - _FOOT)):
            ends_of_edge = ((x0 + _FOOT, y, z + _FOOT), (x1 - _FOOT, y, z + _FOOT))
            found.append(_capsule(f"{side}_foot_{edge}", marks[f"{side}_foot"], *ends_of_edge, _FOOT))
    shoulders, hips = (0.5 * (at(f"left_{part}") + at(f"right_{part}")) for part in ("shoulder", "hip"))
    low = hips + 0.35 * (shoulders - hips)
    found.append(_along(unprofiled, "trunk", unprofiled.limbs.torso, low, shoulders, _THICK["trunk"] * leg))
    pelvis = unprofiled.limbs.pelvis
    found.append(_along(unprofiled, "pelvis", pelvis, at("left_hip"), at("right_hip"), _THICK["pelvis"] * leg))
    if unprofiled.limbs.head != unprofiled.limbs.torso:
        up, radius = np.array([0.0, 0.0, 1.0]), _THICK["head"] * leg
        crown = np.maximum(at("head"), shoulders + _NECK * leg * up)
        ends_of_head = crown - 1.3 * radius * up, crown + 1.3 * radius * up
        found.append(_along(unprofiled, "head", unprofiled.limbs.head, *ends_of_head, radius))
    return [capsule for capsule in found if capsule.body in bare]


def whole_limbs(found: Sequence[Capsule], along: Sequence[Capsule]) -> list[Capsule]:
    """Capsules inside a surface and along limbs, together: a body keeps the one that it has, unless that is a stub of its limb.

    Args:
        found: inside the surfaces of a file that dresses a part of the robot.
        along: of every limb.
    """
    limbs = {c.body: _length(c) for c in along if not c.name.endswith(("foot_left", "foot_right"))}
    kept = [c for c in found if _length(c) >= _STUB * limbs.get(c.body, 0.0)]
    return [*kept, *(c for c in along if c.body not in {k.body for k in kept})]


def _length(capsule: Capsule) -> float:
    return float(np.linalg.norm(np.subtract(capsule.end, capsule.start))) + 2.0 * capsule.radius


def _carrier(unprofiled: UnprofiledModel, first: str, last: str) -> str:
    """The body that the half of a limb is made of: of the chain from its start to its end the one before the longest way."""
    model, data = unprofiled.model, unprofiled.data
    chain = [last]
    while chain[-1] != first and model.body(chain[-1]).id > 1:
        chain.append(model.body(int(model.body(chain[-1]).parentid[0])).name)
    ways = [float(np.linalg.norm(data.body(a).xpos - data.body(b).xpos)) for a, b in pairwise(chain)]
    return chain[1 + int(np.argmax(ways))] if ways else first


def _along(
    unprofiled: UnprofiledModel,
    name: str,
    body: str,
    first: Float[ndarray, "3"],
    last: Float[ndarray, "3"],
    radius: float,
) -> Capsule:
    """A capsule between two places at zero, whose caps end where they are."""
    frame = unprofiled.data.body(body)
    turn, place = frame.xmat.reshape(3, 3), frame.xpos
    way = last - first
    inset = min(radius / max(float(np.linalg.norm(way)), 1e-6), 0.45) * way
    start, end = ((turn.T @ (point - place)) for point in (first + inset, last - inset))
    return _capsule(name, body, tuple(map(float, start)), tuple(map(float, end)), radius)


def _capsule(name: str, body: str, start: tuple[float, ...], end: tuple[float, ...], radius: float) -> Capsule:
    (ax, ay, az), (bx, by, bz) = ([round(v, 4) for v in point] for point in (start, end))
    return Capsule(name=name, body=body, start=(ax, ay, az), end=(bx, by, bz), radius=round(radius, 4))
