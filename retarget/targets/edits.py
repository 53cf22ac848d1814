"""What the user states over the clip's head: touches of the feet and joint angles at key frames, as CSV."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import FREE, GLIDING, PIVOTING, PLANTED, Reference, write_whole
from retarget.errors import RetargetError
from retarget.targets.contacts import Contacts
from robot_models import CONTACT_NAMES, PART_NAMES, RobotModel
from robot_models.incoming import MAX_CONFIG, read_text
from robot_models.maths import intervals_of

KINDS = {"free": FREE, "planted": PLANTED, "pivoting": PIVOTING, "gliding": GLIDING}
_NAMES = (*CONTACT_NAMES, *PART_NAMES)
_CONTACT_COLUMNS = "start", "end", "edge", "kind"
_RADIANS, _DEGREES = ("time", "joint", "value"), ("time", "joint", "degrees")  # columns of key frames


@dataclass(frozen=True, kw_only=True)
class ContactEdit:
    """One edge of a sole, or another part of the body, is of this kind from `start` until `end` [s], whatever was detected."""

    start: float
    end: float
    edge: str  # of CONTACT_NAMES or PART_NAMES
    kind: str  # free, planted, pivoting, gliding


@dataclass(frozen=True, kw_only=True)
class KeyFrame:
    """A joint has this angle [rad] at this time [s] of the dance."""

    time: float
    joint: str
    value: float


def read_contacts(path: Path) -> list[ContactEdit]:
    """Read touches from a CSV with the columns start, end (seconds of the dance), edge, kind.

    Raises:
        RetargetError: a column is missing, or a row does not say an edge, a kind or a time.
    """
    edits = []
    for place, row in _rows(path, _CONTACT_COLUMNS):
        edit = ContactEdit(
            start=_number(place, row["start"]), end=_number(place, row["end"]), edge=row["edge"], kind=row["kind"]
        )
        if edit.edge not in _NAMES or edit.kind not in KINDS or edit.end <= edit.start:
            raise RetargetError(
                place,
                found=", ".join(row.values()),
                expected=f"start before end, an edge of {', '.join(_NAMES)}, a kind of {', '.join(KINDS)}",
            )
        edits.append(edit)
    return edits


def read_keys(path: Path) -> list[KeyFrame]:
    """Read key frames from a CSV with the columns time (seconds of the dance), joint, value (radians) or degrees.

    Raises:
        RetargetError: a column is missing or a number is none.
    """
    keys = []
    for place, row in _rows(path, _RADIANS, _DEGREES):
        angle = _number(place, row["value"]) if "value" in row else np.radians(_number(place, row["degrees"]))
        keys.append(KeyFrame(time=_number(place, row["time"]), joint=row["joint"], value=float(angle)))
    return keys


def write_contacts(reference: Reference, path: Path) -> None:
    """Write what every edge does in its dance as a CSV that `read_contacts` reads, in order of time, to be edited.

    Other parts of the body have rows where any of them ever touches.
    """
    columns, fps = reference.contact[reference.dance], reference.fps
    if reference.part_contact is not None:
        columns = np.concatenate((columns, reference.part_contact[reference.dance]), axis=1)
    rows = [
        (a, k, f"{a / fps:.3f},{b / fps:.3f},{edge},{kind}")
        for k, edge in enumerate(_NAMES[: columns.shape[1]])
        for kind, number in KINDS.items()
        for a, b in intervals_of(columns[:, k] == number)
    ]
    lines = [",".join(_CONTACT_COLUMNS), *(row for *_, row in sorted(rows))]
    with write_whole(path) as stream:
        stream.write(("\n".join(lines) + "\n").encode())


def apply_edits(contacts: Contacts, edits: Iterable[ContactEdit], fps: float) -> Contacts:
    """The touches with the user's own over them; later edits win.

    Raises:
        RetargetError: seconds outside the dance.
    """
    length_s = len(contacts.in_contact) / fps
    in_contact, pivoting, stated = contacts.in_contact.copy(), contacts.pivoting.copy(), contacts.stated.copy()
    stated_parts = contacts.stated_parts.copy()
    for edit in edits:
        if edit.start < 0.0 or edit.end > length_s + 1.0 / fps:
            raise RetargetError(
                f"touch of {edit.edge}", found=f"{edit.start:g} to {edit.end:g} s",
                expected=f"0 to {length_s:.2f} s: seconds of the dance",
            )  # fmt: skip
        frames = slice(max(0, round(edit.start * fps)), max(0, round(edit.end * fps)))
        if edit.edge in PART_NAMES:
            stated_parts[frames, PART_NAMES.index(edit.edge)] = KINDS[edit.kind]
            continue
        edge = CONTACT_NAMES.index(edit.edge)
        in_contact[frames, edge] = stands = edit.kind in ("planted", "pivoting")
        stated[frames, edge] = KINDS[edit.kind]
        if stands:  # what the other edge of the foot does is another row's
            pivoting[frames, edge // 2] = edit.kind == "pivoting"
    both = in_contact.reshape(-1, 2, 2).any(axis=2)
    return replace(contacts, in_contact=in_contact, pivoting=pivoting & both, stated=stated, stated_parts=stated_parts)


def pin_angles(keys: Iterable[KeyFrame], robot: RobotModel, frames: int, fps: float) -> Float[ndarray, "T J"]:
    """Joint angles of the key frames on the dance's frames [rad], NaN elsewhere.

    Raises:
        RetargetError: a time outside the dance or an angle beyond the joint's limits; RobotError for an unknown joint.
    """
    out = np.full((frames, len(robot.joint_names)), np.nan)
    for key in keys:
        j, t = robot.joint(key.joint), round(key.time * fps)
        if not 0 <= t < frames:
            raise RetargetError(
                f"key frame of {key.joint}", found=f"{key.time:g} s", expected=f"0 to {(frames - 1) / fps:.2f} s"
            )
        if not robot.lower[j] <= key.value <= robot.upper[j]:
            raise RetargetError(
                f"key frame of {key.joint} at {key.time:g} s", found=f"{key.value:g} rad",
                expected=f"{robot.lower[j]:.3f} to {robot.upper[j]:.3f} rad",
            )  # fmt: skip
        out[t, j] = key.value
    return out


def _rows(path: Path, *layouts: tuple[str, ...]) -> list[tuple[str, Mapping[str, str]]]:
    text = read_text(path, expected="a readable CSV", most=MAX_CONFIG, error=RetargetError).removeprefix("\ufeff")
    lines = text.splitlines()
    semicolons = bool(lines) and ";" in lines[0]  # as spreadsheets write where commas are decimal
    reader = csv.DictReader(lines, skipinitialspace=True, delimiter=";" if semicolons else ",")
    columns = tuple(reader.fieldnames or ())
    if columns not in layouts:
        known = " or ".join(", ".join(layout) for layout in layouts)
        raise RetargetError(str(path), found=f"columns {reader.fieldnames}", expected=f"columns {known}")
    rows: list[tuple[str, Mapping[str, str]]] = []
    for number, row in enumerate(reader, start=2):
        if None in row or None in row.values():
            raise RetargetError(
                f"{path}, line {number}", found="too few or too many cells", expected=", ".join(columns)
            )
        rows.append((f"{path}, line {number}", row))
    return rows


def _number(place: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise RetargetError(place, found=repr(cell), expected="a finite number")
    return value
