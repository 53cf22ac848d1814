"""Which bodies of an unknown humanoid are its legs, arms and head: from its tree at zero, where it faces +x."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.draft.skeleton_tree import SkeletonTree
from robot_models.errors import RobotError
from robot_models.profile import FEET

if TYPE_CHECKING:
    import mujoco

_HANDS = re.compile(
    r"finger|thumb|gripper|index|little|pinky|(^|_)ring|middle_l?\d|hand_.*_\d|(^|_|left|right|[lr])toes?(base|end|_|$|\d)"
    r"|proximal|intermediate|distal",
    re.IGNORECASE,
)
_TOE = 0.04  # ahead of the joint before it, beyond which the last body of a leg is no ankle but toes [m]
_CLUSTER = 3  # joints of a hip or a shoulder
_MIRRORED = 0.03  # left and right are each other's mirror images to this [m]
_LIMB = 0.2  # of the longest way from the root: no finger is that long
_ARM = 1.5  # times as long as its collar bone, at least
_COLLAR_M = 0.05  # a ball further along an arm than this is its shoulder, and a collar bone what is before it [m]
_APART_M = 0.02  # bodies nearer than this are at one place
_TWIST = 0.7  # cosine between a joint's axis and its limb, from which it turns the limb and does not bend it


@dataclass(frozen=True, kw_only=True)
class Limbs:
    """The robot's bodies by part. Chains go outwards; names are bodies'."""

    pelvis: str
    torso: str
    head: str
    legs: Mapping[str, tuple[str, ...]]  # "left", "right": hip to foot
    arms: Mapping[str, tuple[str, ...]]  # shoulder to wrist
    loose: tuple[str, ...]  # bodies of fingers, grippers and toes

    @property
    def landmarks(self) -> dict[str, str]:
        """Landmark -> body, but for hips and shoulders, which `joint_centre` settles."""
        found = {"pelvis": self.pelvis, "torso": self.torso, "head": self.head}
        for side in FEET:
            found |= {f"{side}_foot": self.legs[side][-1], f"{side}_wrist": self.arms[side][-1]}
        return found


def find_limbs(model: mujoco.MjModel, data: mujoco.MjData, where: str) -> Limbs:
    """The limbs of a model at zero; `data` holds its kinematics there.

    Raises:
        RobotError: no two legs and two arms that are alike.
    """
    bodies = [b for b in range(1, model.nbody) if model.body_jntnum[b]]
    place = {b: k for k, b in enumerate(bodies)}
    names = [model.body(b).name for b in bodies]
    parents = [_moving_parent(model, b, place) for b in bodies]
    loose = _loose(model, bodies, parents)
    firm = [k for k in range(len(bodies)) if k not in loose]
    at = {k: i for i, k in enumerate(firm)}
    positions = data.xpos[[bodies[k] for k in firm]]
    tree = SkeletonTree([at.get(parents[k], -1) for k in firm], positions[None])
    found = _mirrored_limbs(tree, positions) or tree.legs_and_arms()
    if found is None:
        raise RobotError(
            where, found=f"no two legs and two arms among {', '.join(names)}",
            expected="a humanoid: two like branches at the pelvis and two at the trunk",
        )  # fmt: skip
    (pelvis, *legs), (torso, *arms) = found

    def name(k: int) -> str:
        return names[firm[k]]

    chains = {}
    for kind, roots in (("legs", legs), ("arms", arms)):
        ways = sorted((tree.way(r) for r in roots), key=lambda w: -float(positions[w, 1].mean()))
        chains[kind] = {side: tuple(way) for side, way in zip(FEET, ways, strict=True)}
    held = list[int]()
    for side, way in chains["arms"].items():
        first, last = _upper_arm_to_wrist(positions, way)
        chains["arms"][side], held = way[first : last + 1], [*held, *way[last + 1 :]]
    toes = [way[-1] for way in chains["legs"].values() if _has_toes(positions, way)]
    feet = {side: way[:-1] if way[-1] in toes else way for side, way in chains["legs"].items()}
    crown = [c for c in tree.children[torso] if c not in arms]
    head = tree.way(max(crown, key=lambda c: float(positions[tree.way(c)[-1], 2])))[-1] if crown else torso
    return Limbs(
        pelvis=name(pelvis),
        torso=name(torso),
        head=name(head) if positions[head, 2] > positions[torso, 2] else name(torso),
        legs={side: tuple(map(name, way)) for side, way in feet.items()},
        arms={side: tuple(map(name, way)) for side, way in chains["arms"].items()},
        loose=(*(names[k] for k in sorted(loose)), *(name(k) for k in (*toes, *held))),
    )


def _mirrored_limbs(
    tree: SkeletonTree, positions: Float[ndarray, "K 3"]
) -> tuple[tuple[int, int, int], tuple[int, int, int]] | None:
    """(node, child, child) of legs and arms: pairs of branches that mirror each other; legs have the lowest tips.

    Several pairs may hang on one body, as legs, arms and head on that of a small robot.
    """
    pairs = []
    for node, children in enumerate(tree.children):
        for i, a in enumerate(children):
            for b in children[i + 1 :]:
                left, right = (positions[tree.way(c)] - positions[node] * (0.0, 1.0, 0.0) for c in (a, b))
                alike = len(left) == len(right) and np.abs(left * (1.0, -1.0, 1.0) - right).max() < _MIRRORED
                if alike and tree.reach[a] > _LIMB * tree.reach.max():
                    pairs.append((node, a, b))
    legs = min(pairs, key=lambda p: float(positions[tree.way(p[1])[-1], 2]), default=None)
    rest = [p for p in pairs if legs is not None and p != legs and not any(tree.below(leg, p[0]) for leg in legs[1:])]
    return None if legs is None or not rest else (legs, max(rest, key=lambda p: float(tree.reach[p[1]])))


def _upper_arm_to_wrist(positions: Float[ndarray, "K 3"], way: tuple[int, ...]) -> tuple[int, int]:
    """Places in an arm's chain of the first body of its shoulder and the last of its wrist.

    Where every joint of a body model is a ball, three hinges at one place, there is a collar bone before the shoulder and a
    hand beyond the wrist: the upper arm and the forearm are the two long bones that follow one another.
    """
    places = positions[list(way)]
    spread = [float(np.linalg.norm(places[k : k + 3] - places[k], axis=1).max()) for k in range(len(way) - 2)]
    balls = [k for k, wide in enumerate(spread) if wide < _APART_M]
    balls = [k for k in balls if k - 1 not in balls]
    if len(balls) < 4:
        bones = np.linalg.norm(np.diff(places, axis=0), axis=1)
        before, beyond = (float(b.sum()) for b in (bones[: balls[0]], bones[balls[0] :])) if balls else (0.0, 0.0)
        collared = before > _COLLAR_M and beyond > _ARM * before  # else it is a wrist
        return balls[0] if collared else 0, len(way) - 1
    bones = np.linalg.norm(np.diff(places[balls], axis=0), axis=1)
    upper = int(np.argmax(np.minimum(bones[:-1], bones[1:])))
    return balls[upper], balls[upper + 2] + 2


def joint_centre(model: mujoco.MjModel, data: mujoco.MjData, chain: tuple[str, ...]) -> str:
    """The body of a hip or shoulder whose origin lies nearest to where its first axes meet (least squares)."""
    first = [model.body(n).id for n in chain[:_CLUSTER]]
    joints = [int(model.body_jntadr[b]) for b in first]
    across = [np.eye(3) - np.outer(data.xaxis[j], data.xaxis[j]) for j in joints]
    centre = np.linalg.lstsq(
        sum(across), sum(a @ data.xanchor[j] for a, j in zip(across, joints, strict=True)), rcond=None
    )[0]
    # Bodies at one place are told apart by their order: the last one moves with the limb.
    return min(reversed(chain[:_CLUSTER]), key=lambda n: round(float(np.linalg.norm(data.body(n).xpos - centre)), 3))


def middle_joint(model: mujoco.MjModel, data: mujoco.MjData, chain: tuple[str, ...]) -> str:
    """The knee or elbow: the body that bends the chain, far from its start and from what hangs at its end."""
    ends = data.body(chain[0]).xpos, data.body(chain[-1]).xipos
    bending = [n for n in chain[1:] if not _twists(model, data, n, chain)] or chain[1:]
    # Of several at one place the last, which moves with the limb.
    return max(
        reversed(bending), key=lambda n: round(min(float(np.linalg.norm(data.body(n).xpos - e)) for e in ends), 3)
    )


def _twists(model: mujoco.MjModel, data: mujoco.MjData, body: str, chain: tuple[str, ...]) -> bool:
    """Whether a body's joint turns the limb about the length of what is before it, or of what comes after."""
    at, axis = data.body(body).xpos, data.xaxis[int(model.body_jntadr[model.body(body).id])]
    beyond = [data.body(n).xpos for n in chain[chain.index(body) + 1 :]] + [data.body(chain[-1]).xipos]
    after = next((p - at for p in beyond if np.linalg.norm(p - at) > _APART_M), np.zeros(3))
    ways = (at - data.body(chain[0]).xpos, after)
    return any(abs(axis @ way) > _TWIST * np.linalg.norm(way) > 0.0 for way in ways)


def _moving_parent(model: mujoco.MjModel, body: int, place: Mapping[int, int]) -> int:
    """Index of the nearest body above that has a joint."""
    above = int(model.body_parentid[body])
    while above > 0 and above not in place:
        above = int(model.body_parentid[above])
    return place.get(above, -1)


def _loose(model: mujoco.MjModel, bodies: list[int], parents: list[int]) -> set[int]:
    """Fingers, grippers and toes, told by the names of their joints or bodies, and all that hangs from them."""
    loose: set[int] = set()
    for k, body in enumerate(bodies):
        words = (model.body(body).name, model.joint(int(model.body_jntadr[body])).name)
        if parents[k] in loose or (k > 0 and any(_HANDS.search(w) for w in words)):
            loose.add(k)
    return loose


def _has_toes(positions: Float[ndarray, "K 3"], way: tuple[int, ...]) -> bool:
    return len(way) > 2 and bool(positions[way[-1], 0] - positions[way[-2], 0] > _TOE)
