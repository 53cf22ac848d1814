"""The branches of a tree of points: which of them are alike, as two legs or two arms are, and where they bend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

_ALIKE = 0.1  # two limbs of one body differ in length by less than this share
_LIMB = 0.2  # of the longest way from the root: no finger is that long


class SkeletonTree:
    """A tree of points that stand parents first.

    Args:
        parents: index of each point's parent, -1 for roots.
        positions: [m], over T frames; lengths are medians.
    """

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
        for k in reversed(range(count)):
            self.reach[k] = self.bone[k] + max((self.reach[c] for c in self.children[k]), default=0.0)

    def legs_and_arms(self) -> tuple[tuple[int, int, int], tuple[int, int, int]] | None:
        """(node, child, child) of the legs and of the arms.

        Legs are the pair of like branches nearest to the root, arms the longest pair elsewhere.
        """
        pairs = self.pairs()
        if len(pairs) < 2:
            return None
        legs = min(pairs, key=lambda p: (self.depth[p[0]], -self.reach[p[1]]))
        rest = [p for p in pairs if p[0] != legs[0] and not any(self.below(leg, p[0]) for leg in legs[1:])]
        return (legs, max(rest, key=lambda p: self.reach[p[1]])) if rest else None

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
        """Whether `node` is `above`, or hangs from it."""
        while node >= 0 and node != above:
            node = self.parents[node]
        return node == above

    def way(self, first: int) -> list[int]:
        """The longest way down from a point, itself included."""
        way = [first]
        while self.children[way[-1]]:
            way.append(max(self.children[way[-1]], key=lambda c: self.reach[c]))
        return way
