"""Hips, knees and hands of a skeleton whose names tell nothing: from its branches and the lengths of its bones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from robot_models.draft import SkeletonTree
from robot_models.maths import rotation as rot


def _neck_and_head(tree: SkeletonTree, arms: Sequence[int]) -> dict[str, int]:
    """What rises from where the arms begin, as far as it is there."""
    branches = [c for c in tree.children[arms[0]] if c not in arms[1:]]
    if not branches:
        return {}
    neck = max(branches, key=lambda c: tree.reach[c])
    above = tree.children[neck]
    return {"neck": neck, "head": above[0]} if above else {"neck": neck}


def estimate_landmarks(
    names: Sequence[str], parents: Sequence[int], positions: Float[ndarray, "T K 3"]
) -> dict[str, str]:
    """Landmark -> point name, as far as geometry tells; to be confirmed by a person.

    Legs and arms are pairs of like branches. In a limb the two long bones one after the other are thigh and shank, or
    upper arm and forearm. Left is where it is for someone whose toes point ahead, in a right-handed world.
    """
    tree = SkeletonTree(parents, positions)
    pairs = tree.legs_and_arms()
    if pairs is None:
        return {}
    legs, arms = pairs
    leg_joints, arm_joints = ([_limb(tree, c) for c in pair[1:]] for pair in pairs)
    if any(len(joints) < 3 for joints in (*leg_joints, *arm_joints)):
        return {}
    left = _left(positions, leg_joints)
    found = {"pelvis": legs[0], "chest": arms[0]}
    for joints, parts in ((leg_joints, ("hip", "knee", "ankle", "toe")), (arm_joints, ("shoulder", "elbow", "wrist"))):
        sideways = [float(np.median(np.sum(left * positions[:, limb[1]], axis=-1))) for limb in joints]
        for side, limb in zip(("left", "right"), (joints[i] for i in np.argsort(sideways)[::-1]), strict=True):
            found |= {f"{side}_{part}": point for part, point in zip(parts, limb, strict=False)}
    found |= _neck_and_head(tree, arms)
    return {landmark: names[point] for landmark, point in found.items()}


def _limb(tree: SkeletonTree, first: int) -> list[int]:
    """Where the two long bones begin, meet and end, and the point after them, down the longest way from `first`."""
    way = [tree.parents[first], *tree.way(first)]
    if len(way) < 4:
        return []
    # The first bone leads out of the trunk.
    at = max(range(2, len(way) - 1), key=lambda i: min(tree.bone[way[i]], tree.bone[way[i + 1]]))
    return way[at - 1 : at + 3]


def _left(positions: Float[ndarray, "T K 3"], legs: list[list[int]]) -> Float[ndarray, "T 3"]:
    """A person's left: up (hips over ankles) cross forward (toes before ankles)."""
    up = np.sum([positions[:, leg[0]] - positions[:, leg[2]] for leg in legs], axis=0)
    ahead = np.sum([positions[:, leg[-1]] - positions[:, leg[2]] for leg in legs], axis=0)
    return np.asarray(np.cross(up, ahead))


_SEGMENTS = tuple(
    (f"{side}_{begin}", f"{side}_{end}")
    for side in ("left", "right")
    for begin, end in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)


def without_extra_bones(
    known: Mapping[str, str], names: Sequence[str], parents: Sequence[int], positions: Float[ndarray, "T K 3"]
) -> tuple[dict[str, str], list[str]]:
    """Landmarks moved on to where their limb begins, and what was moved: names take a collar bone for a shoulder.

    Where a joint between the two ends of a segment has a long bone on either side and bends, the segment begins there.
    """
    known, moved = dict(known), []
    for begin, end in _SEGMENTS:
        first, last = (list(names).index(known[k]) for k in (begin, end))
        between = _between(parents, first, last)
        for joint, above, below in zip(between[1:-1], between[:-2], between[2:], strict=True):
            bones = positions[:, joint] - positions[:, above], positions[:, below] - positions[:, joint]
            long = min(float(np.median(np.linalg.norm(b, axis=-1))) for b in bones)
            whole = float(np.median(np.linalg.norm(positions[:, last] - positions[:, first], axis=-1)))
            if long > IDENTIFY.long_bone * whole and _bend_deg(*bones) > IDENTIFY.bends_deg:
                moved.append(f"{begin} = {names[joint]}, for the bone from {known[begin]} bends there")
                known[begin] = names[joint]
    return known, moved


def off_bones_deg(
    known: Mapping[str, str], names: Sequence[str], parents: Sequence[int], positions: Float[ndarray, "T K 3"]
) -> tuple[float, str] | None:
    """The largest median angle between a limb's segment and the bone that ends in it [deg], and where; None without bones."""
    found = []
    for begin, end in _SEGMENTS:
        first, last = (list(names).index(known[k]) for k in (begin, end))
        between = _between(parents, first, last)
        if len(between) > 1:
            segment = positions[:, last] - positions[:, first]
            found.append((_bend_deg(segment, positions[:, last] - positions[:, between[-2]]), f"{begin} to {end}"))
    return max(found) if found else None


def _between(parents: Sequence[int], first: int, last: int) -> list[int]:
    """The points from one down to another, both included; empty where they are not above one another."""
    way = [last]
    while way[-1] >= 0 and way[-1] != first:
        way.append(parents[way[-1]])
    return way[::-1] if way[-1] == first else []


def _bend_deg(a: Float[ndarray, "T 3"], b: Float[ndarray, "T 3"]) -> float:
    """Median angle between two directions [deg]; 0 where one has no length."""
    cosine = np.sum(rot.unit(a) * rot.unit(b), axis=-1)
    long = (np.linalg.norm(a, axis=-1) > 1e-9) & (np.linalg.norm(b, axis=-1) > 1e-9)
    return float(np.degrees(np.median(np.arccos(np.clip(cosine[long], -1.0, 1.0))))) if long.any() else 0.0
