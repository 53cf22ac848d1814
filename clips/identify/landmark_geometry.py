"""Hips, knees and hands of a skeleton whose names tell nothing: from its branches and the lengths of its bones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.draft import SkeletonTree


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
