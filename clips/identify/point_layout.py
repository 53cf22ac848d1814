"""Points without names: which of the field's orders of joints keeps its bones' lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.errors import ClipError
from clips.identify.landmark_names import find_landmarks
from clips.provenance import Finding, RawFile, ReadOptions
from robot_models.incoming import read_text

_SOME = 200  # frames whose bones are measured
_RIGID = 0.08  # a bone's standard deviation over its length, of points that are a person's
_CLEARER = 2.0  # times as rigid as the next order
_MOST = 1 << 16  # bytes of a file of names


@dataclass(frozen=True, kw_only=True)
class PointLayout:
    """Names of points in their order, each with the place of its parent (-1 for a root)."""

    names: tuple[str, ...]
    parents: tuple[int, ...]


def _layout(*chains: str, size: int = 0) -> PointLayout:
    """A layout from chains of names; each chain's first point is its root or was named before."""
    names, above = list[str](), dict[str, str]()
    for chain in chains:
        points = chain.split()
        above |= {b: a for a, b in pairwise(points)}
        names += [p for p in points if p not in names]
    names += [f"point_{k}" for k in range(len(names), size)]
    return PointLayout(names=tuple(names), parents=tuple(names.index(above[n]) if n in above else -1 for n in names))


def _in_order(names: str, parents: Mapping[str, str]) -> PointLayout:
    listed = names.split()
    return PointLayout(
        names=tuple(listed), parents=tuple(listed.index(parents[n]) if n in parents else -1 for n in listed)
    )


_SMPL = (
    "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot neck "
    "left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist"
)
_SMPL_PARENTS = {
    "left_hip": "pelvis", "right_hip": "pelvis", "spine1": "pelvis", "spine2": "spine1", "spine3": "spine2",
    "neck": "spine3", "head": "neck", "left_collar": "spine3", "right_collar": "spine3",
} | {
    f"{side}_{part}": f"{side}_{above}"
    for side in ("left", "right")
    for part, above in (
        ("knee", "hip"), ("ankle", "knee"), ("foot", "ankle"), ("shoulder", "collar"), ("elbow", "shoulder"),
        ("wrist", "elbow"), ("hand", "wrist"),
    )
}  # fmt: skip
_COCO = (
    "nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist "
    "left_hip right_hip left_knee right_knee left_ankle right_ankle"
)
_LIMBS = {
    f"{side}_{part}": f"{side}_{above}"
    for side in ("left", "right")
    for part, above in (("knee", "hip"), ("ankle", "knee"), ("elbow", "shoulder"), ("wrist", "elbow"))
}


def _soma(ends: bool) -> PointLayout:
    """SOMA's 77 joints, with every finger, or the 30 without."""
    head = ("HeadEnd Jaw" if ends else "Jaw").split()
    chains = ["Hips Spine1 Spine2 Chest Neck1 Neck2 Head", *(f"Head {part}" for part in (*head, "LeftEye", "RightEye"))]
    for side in ("Left", "Right"):
        chains.append(f"Chest {side}Shoulder {side}Arm {side}ForeArm {side}Hand")
        fingers = ["Thumb", "Index", "Middle", "Ring", "Pinky"] if ends else ["Thumb", "Middle"]
        for finger in fingers:
            joints = [str(k) for k in range(1, 4 if finger == "Thumb" else 5)] if ends else []
            chains.append(" ".join([f"{side}Hand", *(f"{side}Hand{finger}{j}" for j in (*joints, "End"))]))
    for side in ("Left", "Right"):
        end = f" {side}ToeEnd" if ends else ""
        chains.append(f"Hips {side}Leg {side}Shin {side}Foot {side}ToeBase{end}")
    return _layout(*chains)


def _with_hands(count: int) -> PointLayout:
    """SMPL-H's 52 or SMPL-X's 55: the body's 22 first; what follows is of hands and face."""
    body = _in_order(_SMPL, _SMPL_PARENTS)
    more = range(len(body.names), count)
    return PointLayout(names=(*body.names, *(f"point_{k}" for k in more)), parents=(*body.parents, *(-1 for _ in more)))


# Orders by name, from the projects that write them: SMPL (smplx), LAFAN1, HumanML3D's KIT-ML chains, Human3.6M as
# VideoPose3D and its kin keep it, COCO, OpenPose's BODY_25, SOMA (Kimodo).
LAYOUTS: dict[str, PointLayout] = {
    "smpl22": _in_order(_SMPL, _SMPL_PARENTS),
    "smpl24": _in_order(f"{_SMPL} left_hand right_hand", _SMPL_PARENTS),
    "smplh52": _with_hands(52),
    "smplx55": _with_hands(55),
    "lafan22": _layout(
        "Hips LeftUpLeg LeftLeg LeftFoot LeftToe", "Hips RightUpLeg RightLeg RightFoot RightToe",
        "Hips Spine Spine1 Spine2 Neck Head", "Spine2 LeftShoulder LeftArm LeftForeArm LeftHand",
        "Spine2 RightShoulder RightArm RightForeArm RightHand",
    ),
    "kit21": _layout(
        "pelvis spine chest neck head", "neck right_shoulder right_elbow right_wrist",
        "neck left_shoulder left_elbow left_wrist", "pelvis right_hip right_knee right_ankle right_heel right_toe",
        "pelvis left_hip left_knee left_ankle left_heel left_toe",
    ),
    "h36m17": _layout(
        "pelvis right_hip right_knee right_ankle", "pelvis left_hip left_knee left_ankle", "pelvis spine neck nose head",
        "neck left_shoulder left_elbow left_wrist", "neck right_shoulder right_elbow right_wrist",
    ),
    "coco17": _in_order(_COCO, _LIMBS),
    "body25": _in_order(
        "nose neck right_shoulder right_elbow right_wrist left_shoulder left_elbow left_wrist mid_hip right_hip right_knee "
        "right_ankle left_hip left_knee left_ankle right_eye left_eye right_ear left_ear left_toe left_small_toe left_heel "
        "right_toe right_small_toe right_heel", _LIMBS | {"left_hip": "mid_hip", "right_hip": "mid_hip"},
    ),
    "soma77": _soma(True),
    "soma30": _soma(False),
}  # fmt: skip


def point_layout(
    raw: RawFile,
    points: Float[ndarray, "T K 3"],
    options: ReadOptions,
    known: Sequence[str] = (),
    names: Sequence[str] = (),
) -> tuple[PointLayout, Finding]:
    """The order that points stand in.

    Args:
        raw: the file.
        points: in any unit.
        options: `layout` is a name of `LAYOUTS`, or the path of a text with one name a line.
        known: the orders that this kind of file may have; by default every one of as many points.
        names: of the points, where the file has them.

    Raises:
        ClipError: no order of as many points, none whose bones keep their length, or two that do.
    """
    count = points.shape[1]
    if options.layout is not None:
        why = "given"
        return _stated(raw, options.layout, count), Finding(
            what="order of points", value=options.layout, why=why, confidence="stated", option="layout"
        )
    if len(names) == count:
        same = next((layout for layout in LAYOUTS.values() if set(layout.names) == set(names)), None)
        above = (
            {} if same is None else {n: same.names[p] for n, p in zip(same.names, same.parents, strict=True) if p >= 0}
        )
        return _in_order(" ".join(names), above), Finding(
            what="order of points", value="by name", why="the file names them", confidence="stated", option="layout"
        )
    fits = [name for name in known or LAYOUTS if len(LAYOUTS[name].names) == count]
    spread = {name: _spread(points, LAYOUTS[name]) for name in fits}
    found = ", ".join(f"{n}: limbs change their length by {100 * s:.0f} %" for n, s in spread.items())
    best = min(spread, key=lambda n: spread[n], default="")
    others = [s for n, s in spread.items() if n != best]
    if not best or spread[best] > _RIGID or (others and min(others) < _CLEARER * spread[best] + 0.01):
        raise ClipError(
            raw.name, found=f"{count} points without names" + (f" ({found})" if found else ""),
            expected="an order in which the bones keep their length",
            cure="name it, or a text file with one name a line", option="layout", suggestion=best or "names.txt",
        )  # fmt: skip
    return LAYOUTS[best], Finding(what="order of points", value=best, why=found, confidence="measured", option="layout")


def _stated(raw: RawFile, layout: str, count: int) -> PointLayout:
    if layout in LAYOUTS:
        found = LAYOUTS[layout]
    elif Path(layout).suffix == ".txt":
        lines = read_text(Path(layout), expected="one name a line", most=_MOST, error=ClipError).split()
        found = PointLayout(names=tuple(lines), parents=(-1,) * len(lines))
    else:
        raise ClipError(
            "option layout",
            found=repr(layout),
            expected=f"one of {', '.join(LAYOUTS)}, or a .txt of names",
            option="layout",
        )
    if len(found.names) != count:
        raise ClipError(
            raw.name, found=f"{count} points", expected=f"{len(found.names)}, as {layout} has", option="layout"
        )
    return found


def _spread(points: Float[ndarray, "T K 3"], layout: PointLayout) -> float:
    """The largest relative standard deviation of thighs, shanks, upper and lower arms; inf where one has no length."""
    some = points[:: max(1, len(points) // _SOME)]
    at = {k: some[:, layout.names.index(n)] for k, n in find_landmarks(layout.names).items()}
    worst = 0.0
    for part, above in _LIMBS.items():
        lengths = np.linalg.norm(at[part] - at[above], axis=-1)
        mean = float(np.nanmean(lengths)) if np.isfinite(lengths).any() else 0.0
        worst = max(worst, float(np.nanstd(lengths)) / mean if mean > 0.0 else np.inf)
    return worst
