"""Hips, knees and hands of a skeleton whose names tell nothing: from its branches and the lengths of its bones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

_ALIKE = 0.1  # two limbs of one body differ in length by less than this share
_LIMB = 0.2  # of the longest way from the root: no finger is that long


def guess_landmarks(names: Sequence[str], parents: Sequence[int], positions: Float[ndarray, "T K 3"]) -> dict[str, str]:
    """Landmark -> point name, as far as geometry tells; to be confirmed by a person.

    Legs are the pair of like branches nearest to the root, arms the longest pair beyond it. In a limb the two long bones
    one after the other are thigh and shank, or upper arm and forearm. Left is where it is for someone whose toes point
    ahead, in a right-handed world.
    """
    tree = _Tree(parents, positions)
    pairs = tree.pairs()
    if len(pairs) < 2:
        return {}
    legs = min(pairs, key=lambda p: (tree.depth[p[0]], -tree.reach[p[1]]))
    rest = [p for p in pairs if p[0] != legs[0] and not any(tree.below(leg, p[0]) for leg in legs[1:])]
    if not rest:
        return {}
    arms = max(rest, key=lambda p: tree.reach[p[1]])
    leg_joints, arm_joints = ([tree.limb(c) for c in pair[1:]] for pair in (legs, arms))
    if any(len(joints) < 3 for joints in (*leg_joints, *arm_joints)):
        return {}
    left = _left(positions, leg_joints)
    found = {"pelvis": legs[0], "chest": arms[0]}
    for joints, parts in ((leg_joints, ("hip", "knee", "ankle", "toe")), (arm_joints, ("shoulder", "elbow", "wrist"))):
        sideways = [float(np.median(np.sum(left * positions[:, limb[1]], axis=-1))) for limb in joints]
        for side, limb in zip(("left", "right"), (joints[i] for i in np.argsort(sideways)[::-1]), strict=True):
            found |= {f"{side}_{part}": point for part, point in zip(parts, limb, strict=False)}
    neck = [c for c in tree.children[arms[0]] if c not in arms[1:]]
    if neck:
        found["neck"] = max(neck, key=lambda c: tree.reach[c])
        above = tree.children[found["neck"]]
        found |= {"head": above[0]} if above else {}
    return {landmark: names[point] for landmark, point in found.items()}


class _Tree:
    def __init__(self, parents: Sequence[int], positions: Float[ndarray, "T K 3"]) -> None:
        count = len(parents)
        self.parents = parents
        self.children = [[c for c in range(count) if parents[c] == k] for k in range(count)]
        self.bone = np.zeros(count)  # to the parent
        self.depth = [0] * count
        self.reach = np.zeros(count)  # from the parent to the farthest tip beyond, along the bones
        for k in range(count):
            if parents[k] >= 0:
                self.bone[k] = np.median(np.linalg.norm(positions[:, k] - positions[:, parents[k]], axis=-1))
                self.depth[k] = self.depth[parents[k]] + 1
        for k in reversed(range(count)):  # parents stand before their children
            self.reach[k] = self.bone[k] + max((self.reach[c] for c in self.children[k]), default=0.0)

    def pairs(self) -> list[tuple[int, int, int]]:
        """(node, child, child): branches that are long and alike."""
        found = []
        for node, children in enumerate(self.children):
            long = [c for c in children if self.reach[c] > _LIMB * self.reach.max()]
            alike = [
                (abs(self.reach[a] - self.reach[b]), a, b)
                for i, a in enumerate(long)
                for b in long[i + 1 :]
                if abs(self.reach[a] - self.reach[b]) < _ALIKE * self.reach[a]
                and abs(self.bone[a] - self.bone[b]) < _ALIKE * max(self.bone[a], self.bone[b]) + 1e-9
            ]
            if alike:
                found.append((node, *min(alike)[1:]))
        return found

    def below(self, above: int, node: int) -> bool:
        """Whether `node` hangs from `above`."""
        while node >= 0 and node != above:
            node = self.parents[node]
        return node == above

    def limb(self, first: int) -> list[int]:
        """Where the two long bones begin, meet and end, and the point after them, down the longest way from `first`."""
        way = [self.parents[first], first]
        while self.children[way[-1]]:
            way.append(max(self.children[way[-1]], key=lambda c: self.reach[c]))
        if len(way) < 4:
            return []
        # The first bone leads out of the trunk.
        at = max(range(2, len(way) - 1), key=lambda i: min(self.bone[way[i]], self.bone[way[i + 1]]))
        return [p for p in way[at - 1 : at + 3] if p >= 0]


def _left(positions: Float[ndarray, "T K 3"], legs: list[list[int]]) -> Float[ndarray, "T 3"]:
    """A person's left: up (hips over ankles) cross forward (toes before ankles)."""
    up = np.sum([positions[:, leg[0]] - positions[:, leg[2]] for leg in legs], axis=0)
    ahead = np.sum([positions[:, leg[-1]] - positions[:, leg[2]] for leg in legs], axis=0)
    return np.asarray(np.cross(up, ahead))
