"""Which point of a skeleton is the left knee: names to landmarks, for any naming custom of the field."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.provenance import UNITS, Finding, ReadOptions

# Names without side, first match wins. The order settles the customs that clash: `LeftShoulder` is a collar bone
# where a `LeftArm` exists; `left_foot` is the toe base where a `left_ankle` exists; `LeftLeg` is the shin.
_SIDED = {
    "hip": ("upleg", "upperleg", "thigh", "thighbend", "femur", "hip", "leg"),
    "knee": ("knee", "lowerleg", "calf", "shin", "tibia", "leg"),
    "ankle": ("ankle", "foot"),
    "toe": ("toebase", "toe", "toes", "toe0", "footindex", "ball", "foot"),
    "shoulder": ("upperarm", "uarm", "arm", "humerus", "shldrbend", "shoulder", "shldr"),
    "elbow": ("elbow", "forearm", "farm", "forearmbend", "lowerarm", "radius"),
    "wrist": ("wrist", "hand"),
}
_MIDDLE = {
    "pelvis": ("pelvis", "hips", "hip", "midhip", "root", "lowerback"),
    "chest": (
        "chest4", "chest3", "spine3", "chest2", "spine2", "upperchest", "chest", "torso", "t8", "spine03", "spine1", "thorax"
    ),
    "neck": ("neck", "neck1", "neck01"),
    "head": ("head", "nose"),
}  # fmt: skip
# Of Mixamo, 3ds Max, VRM, Rigify, HumanIK, FreeMoCap: what stands before a name in every joint.
_PREFIX = re.compile(
    r"^(.*[:|]|mixamorig\d*_?|j_bip_(c_)?|(def|org)-|character\d*_|(bip\d*|joint|j|body)[_ ])", re.IGNORECASE
)

_SIDE = re.compile(r"left|right|(?<![a-z])[lr](?![a-z])", re.IGNORECASE)


def find_landmarks(names: Sequence[str]) -> dict[str, str]:
    """Landmark -> point name, for every landmark that a name tells."""
    prefix = _common_prefix(names)
    plain = {_split(n.removeprefix(prefix)): n for n in reversed(names)}
    plain |= {told: n for n in names if (told := _side_by_pair(n, names)) is not None and told not in plain}
    found: dict[str, str] = {}
    for side in ("left", "right"):
        for part, customs in _SIDED.items():
            taken = set(found.values())
            hits = [plain[side, c] for c in customs if (side, c) in plain and plain[side, c] not in taken]
            if hits:
                found[f"{side}_{part}"] = hits[0]
    for part, customs in _MIDDLE.items():
        hits = [plain["", c] for c in customs if ("", c) in plain]
        if hits:
            found[part] = hits[0]
    return found


def _side_by_pair(name: str, names: Sequence[str]) -> tuple[str, str] | None:
    """Side and bare name of `lhip` beside `rhip`, as MakeHuman's CMU rig and others in small letters are called."""
    other, rest = {"l": "r", "r": "l"}.get(name[:1]), name[1:]
    if other is None or f"{other}{rest}" not in names or not any(rest in customs for customs in _SIDED.values()):
        return None
    return ("left" if other == "r" else "right"), rest


def _common_prefix(names: Sequence[str]) -> str:
    """What stands before every name, up to a sign that divides: `Ben_` of `Ben_Hips` and `Ben_LeftLeg`; no side of the body."""
    if len(names) < 2:
        return ""
    first, last = min(names), max(names)  # what the first and the last share, all others between them do
    shared = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    common = re.match(r"^.*[_:|. -]", first[:shared])
    return "" if common is None or _SIDE.search(common[0]) else common[0]


def _split(name: str) -> tuple[str, str]:
    """Side ("left", "right" or "") and bare lower-case name: `mixamorig:LeftUpLeg` -> ("left", "upleg")."""
    bare = _PREFIX.sub("", name).strip()
    for side in ("left", "right"):
        if re.match(side, bare, re.IGNORECASE) or re.search(rf"{side}$", bare, re.IGNORECASE):
            return side, _letters(re.sub(side, "", bare, count=1, flags=re.IGNORECASE))
    match = (
        re.match(r"^(.*?)[_ .]([lrLR])$", bare)
        or re.match(r"^([lrLR])(?=[_ .A-Z])[_ .]?(.*)$", bare)
        or re.match(r"^(.*[a-z])([LR])$", bare)
    )
    if match:
        a, b = match.groups()
        letter, rest = (a, b) if len(a) == 1 and a in "lrLR" else (b, a)
        return ("left" if letter in "lL" else "right"), _letters(rest)
    return "", _letters(bare)


def _letters(text: str) -> str:
    return re.sub(r"[^a-z0-9]", "", text.lower())


def find_unit(legs: Float[ndarray, "T 2"], options: ReadOptions, where: str) -> tuple[float, Finding]:
    """Metres per file unit from the length of the legs (hip to knee to ankle, in file units).

    A person's legs are 0.62 to 1.05 m long, so at most one customary unit fits. Where none does, only the subject's
    stature can settle the scale; 1.70 m is assumed and said.
    """
    leg = float(np.median(legs))
    if not leg > 0.0:
        raise ClipError(where, found="legs of length zero", expected="hips, knees and ankles in different places")
    if options.unit is not None:
        scale = UNITS[options.unit] if options.unit in UNITS else float(options.unit)
        return scale, Finding(what="unit", value=options.unit, why="given", confidence="stated", option="unit")
    if options.stature is not None:
        scale = options.stature * IDENTIFY.leg_share / leg
        why = f"stature {options.stature} m given"
        return scale, Finding(what="unit", value=f"{scale:.4g} m", why=why, confidence="stated", option="stature")
    fits = [u for u, s in UNITS.items() if IDENTIFY.legs[0] <= leg * s <= IDENTIFY.legs[1]]
    if fits:
        why = f"legs of {leg:.4g} units would be {leg * UNITS[fits[0]]:.2f} m; a person's are 0.62 to 1.05 m"
        return UNITS[fits[0]], Finding(what="unit", value=fits[0], why=why, confidence="measured", option="unit")
    scale = IDENTIFY.stature * IDENTIFY.leg_share / leg
    why = f"legs of {leg:.4g} units fit no customary unit; a stature of 1.70 m is assumed"
    return scale, Finding(what="unit", value=f"{scale:.4g} m", why=why, confidence="assumed", option="stature")


def stature(legs: Float[ndarray, "T 2"]) -> float:
    """Height of a person from the leg length [m]: the only segment that every skeleton has whole."""
    return float(np.median(legs)) / IDENTIFY.leg_share


def leg_lengths(positions: Float[ndarray, "T K 3"], names: Sequence[str], landmarks: Mapping[str, str]) -> ndarray:
    """Hip to knee to ankle per frame and side, in the unit of the positions."""
    legs = []
    for side in ("left", "right"):
        chain = [positions[:, list(names).index(landmarks[f"{side}_{p}"])] for p in ("hip", "knee", "ankle")]
        legs.append(np.linalg.norm(np.diff(chain, axis=0), axis=-1).sum(axis=0))
    return np.stack(legs, axis=-1)
