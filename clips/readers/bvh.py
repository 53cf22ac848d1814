"""BVH of any skeleton: per-joint channel order, repeated offsets, names with spaces, several people, any up axis and unit."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import REQUIRED, HumanClip
from clips.errors import ClipError, SeveralClipsError
from clips.identify import find_landmarks, human_clip
from clips.provenance import FASTEST, Finding, RawFile, ReadOptions
from robot_models.maths import rotation as rot

_MOST_JOINTS, _MOST_ENDS = 1000, 100
_BLOCK = 2048  # frames worked on at a time
_LEAST_BODY = 15  # joints of a tree that is a person's, whatever their names
_TOKEN = re.compile(
    r"\b(?:ROOT|JOINT)\b[ \t]*[^\r\n{}]*|[{}]|[^\s{}]+"
)  # a joint with its name, to the end of the line
_COMMA, _POINT = re.compile(r"(?<=\d),(?=\d)"), re.compile(r"(?<![A-Za-z])\d+\.\d")  # between digits of numbers
_MOTION = re.compile(r"(?<!\S)MOTION(?!\S)")  # no part of a joint's name
_CHANNEL = re.compile(r"[XYZ](position|rotation)", re.IGNORECASE)


@dataclass
class _Joint:
    name: str
    parent: int
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    channels: list[str] = field(default_factory=list)


def recognises(raw: RawFile) -> bool:
    """BVH begins with the word HIERARCHY."""
    return raw.head.lstrip().startswith(b"HIERARCHY")


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read a BVH file into points and orientations.

    Raises:
        ClipError: broken hierarchy, wrong number of values, no person in it.
    """
    hierarchy, *rest = _MOTION.split(raw.text(), maxsplit=1)
    motion = rest[0] if rest else ""
    if not motion:
        raise ClipError(raw.name, found="no MOTION section", expected="HIERARCHY, then MOTION")
    joints = _parse_hierarchy(_with_points(hierarchy), raw.name)
    fps, fps_finding, count, rows = _rate(_with_points(motion), options, raw.name)
    values = _parse_rows(count, rows, sum(len(j.channels) for j in joints), raw.name)
    person = _person(joints, options, raw.name)
    positions, orientations, offsets = _pose(joints, values)
    del values, hierarchy, motion, rows  # an hour of them is a quarter of a gigabyte
    keep = [i for i, j in enumerate(joints) if (j.channels or any(j.offset)) and i in person]
    place = {j: k for k, j in enumerate(keep)}
    orders = sorted({_rotation_order(j) for j in joints if j.channels})
    findings = [
        fps_finding,
        Finding(what="Euler order", value=", ".join(orders), why="CHANNELS of each joint", confidence="stated"),
        offsets,
    ]
    return human_clip(
        raw,
        dialect=f"BVH, {sum(bool(j.channels) for j in joints)} joints",
        fps=fps,
        names=[joints[i].name for i in keep],
        positions=positions if len(keep) == len(joints) else positions[:, keep],
        orientations=orientations if len(keep) == len(joints) else orientations[:, keep],
        parents=[place.get(joints[i].parent, -1) for i in keep],
        options=options,
        findings=findings,
    )


def _parse_hierarchy(text: str, where: str) -> list[_Joint]:
    joints: list[_Joint] = []
    stack: list[int] = []
    tokens = iter(_TOKEN.findall(text))
    try:
        for token in tokens:
            kind, *name = token.split(maxsplit=1)
            if kind in ("ROOT", "JOINT", "End"):
                said = name[0] if name else next(tokens)  # the name, or the word Site
                joints.append(_joint(kind, said.strip(), stack[-1] if stack else -1, joints))
            elif token == "{":
                stack.append(len(joints) - 1)
            elif token == "}":
                stack.pop()
            elif token == "OFFSET":
                joints[-1].offset = tuple([float(next(tokens)) for _ in range(3)])
                if not all(abs(x) < 1e9 for x in joints[-1].offset):
                    raise ValueError("an absurd OFFSET")
            elif token == "CHANNELS":
                joints[-1].channels = [next(tokens) for _ in range(int(next(tokens)))]
                if not all(_CHANNEL.fullmatch(c) for c in joints[-1].channels):
                    raise ValueError("an unknown channel")
    except (StopIteration, IndexError, ValueError) as e:
        last = joints[-1].name if joints else "the start"
        raise ClipError(f"{where}, near '{last}'", found="a broken HIERARCHY", expected="BVH's nested joints") from e
    _check_size(joints, where)
    return joints


def _check_size(joints: list[_Joint], where: str) -> None:
    width = sum(len(j.channels) for j in joints)
    if width == 0:
        raise ClipError(where, found="no joint with channels", expected="at least a root with CHANNELS")
    if len(joints) > min(_MOST_JOINTS, width + _MOST_ENDS):
        raise ClipError(where, found=f"{len(joints)} joints with {width} channels", expected="a body's")


def _joint(kind: str, name: str, parent: int, joints: list[_Joint]) -> _Joint:
    if kind == "End":
        name = f"{joints[parent].name}_end"
    if len(joints) > _MOST_JOINTS:
        raise ValueError("more joints than any body has")
    taken = {j.name for j in joints}
    while name in taken:  # some exporters repeat finger names
        name += "_"
    return _Joint(name, parent)


def _with_points(text: str) -> str:
    """Text whose numbers are written with decimal points, as programs in some languages write them with commas."""
    return _COMMA.sub(".", text) if "," in text and not _POINT.search(text) else text


def _rate(text: str, options: ReadOptions, where: str) -> tuple[float, Finding, str, str]:
    """Frames per second, how they are known, and as texts the number of frames and their rows."""
    if re.match(r"\s*Frames:\d", text):
        text = text.replace("Frames:", "Frames: ", 1)
    words = text.split(maxsplit=5)
    if len(words) < 5 or words[0] != "Frames:" or words[2:4] != ["Frame", "Time:"]:
        raise ClipError(
            f"{where}, MOTION", found="no 'Frames:' and 'Frame Time:' lines", expected="Frames, Frame Time, rows"
        )
    try:
        dt = float(words[4].replace(",", "."))
    except ValueError:
        dt = float("nan")
    if options.fps is None and not dt > 0.0:
        raise ClipError(
            f"{where}, Frame Time", found=repr(words[4]), expected="seconds above 0", cure="state the frame rate",
            option="fps", suggestion="30",
        )  # fmt: skip
    why = "Frame Time line" if options.fps is None else f"given; the Frame Time line says {words[4]} s"
    fps = options.fps or _whole(1.0 / dt)
    finding = Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")
    return fps, finding, words[1], words[5] if len(words) > 5 else ""


def _whole(fps: float) -> float:
    """A rate within the rounding of its frame time, which is written with 6 or 7 digits, of a whole number is that number."""
    return float(round(fps)) if fps < FASTEST and abs(fps - round(fps)) < 1e-6 * fps**2 else fps


def _parse_rows(count: str, text: str, width: int, where: str) -> Float[ndarray, "T W"]:
    """The channels of every frame from the texts of their number and rows."""
    try:
        frames = int(count)
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # text that is no number ends numpy's reading with one
            values = np.fromstring(text, sep=" ")
    except (DeprecationWarning, ValueError) as e:
        commas = "numbers with decimal points, as the rest has them" if "," in text else "numbers"
        raise ClipError(f"{where}, MOTION", found="text among the numbers", expected=commas) from e
    if values.size != frames * width:
        raise ClipError(
            f"{where}, MOTION",
            found=f"{values.size} values",
            expected=f"{frames} frames x {width} channels = {frames * width}",
            cure="the file is cut off or its header edited: export it again",
        )
    if not (np.abs(values) < 1e9).all():
        raise ClipError(
            f"{where}, MOTION", found="numbers that are not finite, or absurd", expected="lengths and degrees"
        )
    return values.reshape(frames, width)


def _person(joints: list[_Joint], options: ReadOptions, where: str) -> set[int]:
    """The joints that belong to the one person, and what stands beside him or her; of several people those that are asked for.

    Raises:
        ClipError: several people and nobody said whom, or somebody who is not there.
    """
    root = list(range(len(joints)))
    for i, joint in enumerate(joints):  # parents stand before their children
        root[i] = i if joint.parent < 0 else root[joint.parent]
    trees = {r: [i for i in range(len(joints)) if root[i] == r] for r in dict.fromkeys(root)}
    people = [r for r, tree in trees.items() if _is_body([joints[i].name for i in tree])]
    if options.person is None and len(people) < 2:
        return set(range(len(joints)))
    names = [joints[r].name for r in people]
    numbers = {str(k + 1): r for k, r in enumerate(people)} | {joints[r].name: r for r in trees}
    if options.person in numbers:
        return set(trees[numbers[options.person]])
    refusal = (
        partial(SeveralClipsError, names=tuple(names)) if len(people) > 1 and options.person is None else ClipError
    )
    raise refusal(
        where, found=f"{len(people)} people ({', '.join(names)})" if len(people) > 1 else f"no person '{options.person}'",
        expected=f"one of {', '.join(names)}" if names else "a body", cure="say which, by name or by number",
        option="person", suggestion="1",
    )  # fmt: skip


def _is_body(names: list[str]) -> bool:
    return set(REQUIRED) <= set(find_landmarks(names)) or len(names) >= _LEAST_BODY


def _rotation_order(joint: _Joint) -> str:
    return "".join(c[0].upper() for c in joint.channels if c.lower().endswith("rotation"))


def _pose(joints: list[_Joint], values: Float[ndarray, "T W"]) -> tuple[ndarray, ndarray, Finding]:
    """World positions and orientations of every joint, in the file's axes and unit."""
    positions = np.empty((len(values), len(joints), 3))
    turns = np.empty((len(values), len(joints), 4))
    added = _added(joints, values)
    for first in range(0, len(values), _BLOCK):  # so that what is worked on stays in the cache
        block = slice(first, first + _BLOCK)
        _pose_block(joints, values[block], added, positions[block], turns[block])
    moving = sum(any(c.lower().endswith("position") for c in j.channels) for j in joints)
    names = [joints[i].name for i in added]
    value = f"added to OFFSET at {', '.join(names)}" if names else "in place of OFFSET"
    why = f"{moving} joints have position channels; theirs are compared with OFFSET"
    return positions, turns, Finding(what="position channels", value=value, why=why, confidence="measured")


def _pose_block(
    joints: list[_Joint], values: Float[ndarray, "T W"], added: set[int], positions: ndarray, turns: ndarray
) -> None:
    """Forward kinematics into `positions` and `turns`."""
    column = 0
    for i, joint in enumerate(joints):
        block = values[:, column : column + len(joint.channels)]
        column += len(joint.channels)
        moved = _moved(joint, block)
        local = np.array(joint.offset) if moved is None else moved + np.array(joint.offset) * (i in added)
        angles = [k for k, c in enumerate(joint.channels) if c.lower().endswith("rotation")]
        turn = rot.from_euler(np.radians(block[:, angles]), _rotation_order(joint)) if angles else rot.IDENTITY
        if joint.parent < 0:
            positions[:, i], turns[:, i] = local, turn
        else:
            parent = turns[:, joint.parent]
            positions[:, i] = positions[:, joint.parent] + rot.rotate(parent, local)
            turns[:, i] = rot.multiply(parent, turn)


def _added(joints: list[_Joint], values: Float[ndarray, "T W"]) -> set[int]:
    """Joints whose position channels hover near zero beside a real offset, and so stand on top of it.

    Elsewhere they stand in place of OFFSET: adding both where they repeat each other would double the bones.
    """
    found, column = set(), 0
    for i, joint in enumerate(joints):
        moved = _moved(joint, values[:, column : column + len(joint.channels)])
        column += len(joint.channels)
        size = float(np.linalg.norm(joint.offset))
        if moved is None or size == 0.0 or joint.parent < 0:
            continue
        if np.median(np.linalg.norm(moved, axis=1)) < 0.2 * size:
            found.add(i)
    return found


def _moved(joint: _Joint, block: Float[ndarray, "T C"]) -> Float[ndarray, "T 3"] | None:
    """What the joint's position channels say; None where it has none."""
    columns = [(k, "XYZ".index(c[0].upper())) for k, c in enumerate(joint.channels) if c.lower().endswith("position")]
    if not columns:
        return None
    moved = np.zeros((len(block), 3))
    for k, axis in columns:
        moved[:, axis] = block[:, k]
    return moved
