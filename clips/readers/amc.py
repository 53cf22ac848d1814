"""AMC motion on its ASF skeleton (Acclaim; CMU's mocap library).

A bone's rotation is C M C^-1: M by its degrees of freedom in the order that they are listed, C from its `axis` line. The
bone lies along `direction`, `length` long, and turns about its start.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import HumanClip
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from robot_models.maths import rotation as rot

# Points stand where bones begin: a thigh's is the hip.
_SIDED = {
    "hip": "femur", "knee": "tibia", "ankle": "foot", "toe": "toes", "shoulder": "humerus", "elbow": "radius", "wrist": "wrist"
}  # fmt: skip
_MIDDLE = {"pelvis": "root", "chest": "thorax", "neck": "lowerneck", "head": "head"}

_MOST_BONES = 1000


@dataclass
class _Bone:
    name: str
    parent: int = -1
    vector: tuple[float, ...] = (0.0, 0.0, 0.0)  # from start to end
    axis: tuple[float, ...] = (0.0, 0.0, 0.0)
    axis_order: str = "XYZ"
    dof: tuple[str, ...] = ()


def recognises(raw: RawFile) -> bool:
    """AMC says how it is specified before its first frame; an ASF has sections instead."""
    return b":FULLY-SPECIFIED" in raw.head.upper() or (
        b":DEGREES" in raw.head.upper() and b":BONEDATA" not in raw.head.upper()
    )


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read an AMC with the ASF that lies beside it.

    Raises:
        ClipError: no or several skeletons, bones that do not match, no frame rate stated, no person in it.
    """
    asf = _skeleton_of(raw, options)
    bones, length = _parse_skeleton(asf)
    values, degrees = _parse_motion(raw, bones)
    if options.fps is None:
        raise ClipError(
            raw.name, found="no frame rate: AMC has none", expected="a stated one; CMU's index says 120 for most of its clips",
            cure="state it", option="fps", suggestion="120",
        )  # fmt: skip
    positions, orientations = _pose(bones, values, 1.0 if not degrees else np.pi / 180.0)
    names = [b.name for b in bones]
    landmarks = {f"{s}_{k}": f"{s[0]}{b}" for s in ("left", "right") for k, b in _SIDED.items()}
    landmarks = {k: b for k, b in (landmarks | _MIDDLE).items() if b in names}
    findings = [
        Finding(what="fps", value=f"{options.fps:g}", why="given", confidence="stated", option="fps"),
        Finding(what="skeleton", value=asf.name, why=f"its length unit is {length:g}", confidence="stated", option="skeleton"),
        Finding(
            what="Euler order", value=", ".join(sorted({"".join(d[1] for d in b.dof).upper() for b in bones if b.dof})),
            why="the skeleton's dof lines", confidence="stated",
        ),
    ]  # fmt: skip
    return human_clip(
        raw,
        dialect=f"AMC on ASF, {sum(bool(b.dof) for b in bones)} moving bones",
        fps=options.fps,
        names=names,
        positions=positions,
        orientations=orientations,
        parents=[b.parent for b in bones],
        options=options,
        findings=findings,
        landmarks=landmarks,
    )


def _skeleton_of(raw: RawFile, options: ReadOptions) -> RawFile:
    """The ASF: the one named, or the one beside it whose name the AMC's begins with (12_01.amc: 12.asf)."""
    if options.skeleton is not None:
        return RawFile.load(Path(options.skeleton))
    beside = sorted(p for p in raw.path.parent.iterdir() if p.suffix.lower() == ".asf")
    named = [p for p in beside if raw.path.stem.lower().startswith(p.stem.lower())]
    fitting = [max(named, key=lambda p: len(p.stem))] if named else beside
    if len(fitting) != 1:
        raise ClipError(
            raw.name, found=f"{len(beside)} ASF skeletons beside it" if beside else "no ASF skeleton beside it",
            expected="the one that it was recorded on: lengths and axes of its bones", cure="name it", option="skeleton",
            suggestion=str(beside[0]) if beside else "FILE.asf",
        )  # fmt: skip
    return RawFile.load(fitting[0])


def _parse_skeleton(raw: RawFile) -> tuple[list[_Bone], float]:
    """Bones, parents first, and what the file says of its unit of length."""
    sections: dict[str, list[str]] = {}
    lines: list[str] = []
    for line in raw.text().splitlines():
        words = line.split()
        if words and words[0].startswith(":"):
            lines = sections.setdefault(words[0][1:].lower(), [])
        elif words and not words[0].startswith("#"):
            lines.append(line)
    try:
        length = float(dict(s.split()[:2] for s in sections.get("units", []) if len(s.split()) > 1).get("length", "1"))
        root = {s.split()[0].lower(): s.split()[1:] for s in sections["root"]}
        first = _Bone("root", dof=tuple(w.lower() for w in root["order"]), axis_order=root["axis"][0].upper())
        first.axis = tuple(float(w) for w in root.get("orientation", ["0", "0", "0"]))
        found = {"root": first} | {b.name: b for b in _parse_bones(sections["bonedata"])}
        bones, place = [first], {"root": 0}
        for line in sections["hierarchy"]:
            parent, *children = line.split()
            for child in children if parent not in ("begin", "end") else ():
                bone = found[child]
                bone.parent, place[child] = place[parent], len(bones)
                bones.append(bone)
        if len(bones) > _MOST_BONES:
            raise ValueError(f"{len(bones)} bones")
    except (KeyError, IndexError, ValueError) as e:
        raise ClipError(
            raw.name, found=f"a skeleton that cannot be read ({type(e).__name__}: {e})", expected="ASF sections"
        ) from e  # fmt: skip
    return bones, length


def _parse_bones(lines: list[str]) -> list[_Bone]:
    bones: list[_Bone] = []
    direction, length = np.zeros(3), 0.0
    for line in lines:
        key, *words = line.split()
        if key == "begin":
            bones.append(_Bone(""))
        elif key == "name":
            bones[-1].name = words[0]
        elif key == "direction":
            direction = np.array([_number(w) for w in words[:3]])
        elif key == "length":
            length = _number(words[0])
        elif key == "axis":
            bones[-1].axis, bones[-1].axis_order = tuple(_number(w) for w in words[:3]), words[3].upper()
        elif key == "dof":
            bones[-1].dof = tuple(w.lower() for w in words)
        elif key == "end":
            bones[-1].vector = tuple(length * rot.unit(direction)) if length else (0.0, 0.0, 0.0)
    return bones


def _number(word: str) -> float:
    value = float(word)
    if not abs(value) < 1e6:
        raise ValueError(f"'{word}' among the numbers of a skeleton")
    return value


def _parse_motion(raw: RawFile, bones: list[_Bone]) -> tuple[dict[str, Float[ndarray, "T D"]], bool]:
    """Values of every bone that moves, by name; whether angles are degrees."""
    text = [s for s in raw.text().splitlines() if s.strip() and not s.lstrip().startswith("#")]
    said = [s.strip().upper() for s in text if s.lstrip().startswith(":")]
    words = " ".join(s for s in text if not s.lstrip().startswith(":")).split()
    known, columns, at = {b.name: len(b.dof) for b in bones}, {}, 1
    while at < len(words) and not words[at].lstrip("-").isdigit() and words[at] in known:
        columns[words[at]] = slice(at + 1, at + 1 + known[words[at]])
        at += 1 + known[words[at]]
    frames, rest = divmod(len(words), at)
    following = words[at] if at < len(words) else "1"
    if rest or frames == 0 or "root" not in columns or not following.isdigit():
        strange = following
        raise ClipError(
            raw.name, found=f"{len(words)} words in frames of {at}, then '{strange}'",
            expected="the same bones in every frame, each with the values of the skeleton's dof line",
            cure="is this its skeleton? name another, or export both again", option="skeleton",
        )  # fmt: skip
    table = np.array(words).reshape(frames, at)
    try:
        if any((table[:, c.start - 1] != name).any() for name, c in columns.items()):
            raise ValueError("frames differ in their bones")
        values = {name: table[:, c].astype(float) for name, c in columns.items()}
        numbers = table[:, 0].astype(int)
        if not all((np.abs(v) < 1e6).all() for v in values.values()):
            raise ValueError("numbers that are not finite, or absurd")
    except ValueError as e:
        raise ClipError(raw.name, found=str(e), expected="one number per degree of freedom") from e
    if (np.diff(numbers) != 1).any():
        at = int(np.argmax(np.diff(numbers) != 1))
        raise ClipError(
            raw.name, found=f"frame {numbers[at + 1]} after {numbers[at]}", expected="frames one after another"
        )
    return values, ":RADIANS" not in said


def _by_channels(bone: _Bone, told: ndarray, radians: float) -> tuple[ndarray, ndarray]:
    """How far the channels of a bone move it and turn it, in its own axes."""
    moved, turn = np.zeros((len(told), 3)), np.broadcast_to(rot.IDENTITY, (len(told), 4))
    for k, dof in enumerate(bone.dof):
        axis = np.eye(3)["xyz".index(dof[1])] if dof[0] in "rt" and len(dof) == 2 else np.zeros(3)
        if dof[0] == "t":
            moved = moved + told[:, k : k + 1] * axis
        elif dof[0] == "r":
            # The first one listed is applied first.
            turn = rot.multiply(rot.exp(radians * told[:, k : k + 1] * axis), turn)
    return moved, turn


def _pose(bones: list[_Bone], values: dict[str, ndarray], radians: float) -> tuple[ndarray, ndarray]:
    """World positions of the bones' starts and their orientations, in the file's axes and unit."""
    frames = len(values["root"])
    starts, ends = np.zeros((2, frames, len(bones), 3))
    turns = np.tile(rot.IDENTITY, (frames, len(bones), 1))
    for i, bone in enumerate(bones):
        told = values.get(bone.name, np.zeros((frames, len(bone.dof))))
        moved, turn = _by_channels(bone, told, radians)
        frame = rot.IDENTITY
        for letter in bone.axis_order:
            angle = np.radians(bone.axis["XYZ".index(letter)]) if radians != 1.0 else bone.axis["XYZ".index(letter)]
            frame = rot.multiply(rot.exp(angle * np.eye(3)["XYZ".index(letter)]), frame)
        local = rot.multiply(rot.multiply(frame, turn), rot.conjugate(frame))
        if bone.parent < 0:
            starts[:, i], turns[:, i] = moved, local
        else:
            starts[:, i] = ends[:, bone.parent]
            turns[:, i] = rot.multiply(turns[:, bone.parent], local)
        ends[:, i] = starts[:, i] + rot.rotate(turns[:, i], np.array(bone.vector))
    return starts, turns
