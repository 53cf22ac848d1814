"""Motive's CSV (OptiTrack): header rows of type, name and quantity over the columns; a skeleton's bones, or else its markers."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import HumanClip
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers.marker_clip import marker_clip
from clips.readers.one_of_several import one_of_several
from clips.readers.rates import unit
from clips.readers.table import WIDEST, number_rows
from robot_models.maths import rotation as rot

_UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "inch", "feet": "0.3048"}
_HEADER_LINES = 12  # among which the column titles stand
_LEAST_BONES = 12
# Bones of Motive's skeletons, which parents precede.
_PARENTS = {
    "Ab": "Hip", "Spine": "Hip", "Spine2": "Spine", "Chest": "Ab", "Neck": "Chest", "Head": "Neck", "LShoulder": "Chest",
    "RShoulder": "Chest", "LUArm": "LShoulder", "RUArm": "RShoulder", "LFArm": "LUArm", "RFArm": "RUArm", "LHand": "LFArm",
    "RHand": "RFArm", "LThigh": "Hip", "RThigh": "Hip", "LShin": "LThigh", "RShin": "RThigh", "LFoot": "LShin",
    "RFoot": "RShin", "LToe": "LFoot", "RToe": "RFoot",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class _Column:
    kind: str  # "Bone", "Marker", "Bone Marker", "Rigid Body" ...
    name: str
    quantity: str  # "Position", "Rotation", "Mean Marker Error"
    axis: str  # "X", "Y", "Z", "W"


def recognises(raw: RawFile) -> bool:
    """The cell that every export begins with."""
    return raw.head.lstrip().startswith((b"Format Version", b'"Format Version'))


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read the bones of one skeleton, or labelled markers.

    Raises:
        ClipError: columns whose header is not whole, local coordinates, no rate or unit, several skeletons and none asked for.
    """
    lines = raw.text().splitlines()
    said = dict(zip(*[iter(next(csv.reader(lines[:1])))] * 2, strict=False))
    if said.get("Coordinate Space", "Global") != "Global":
        raise ClipError(
            f"{raw.name}, Coordinate Space", found=said["Coordinate Space"], expected="Global", cure="export it so"
        )
    columns, titles = _columns(raw, lines)
    values = number_rows(raw, lines, first=titles + 1, width=len(columns) + 2, separator=",")[:, 2:]
    fps = _rate(raw, said, options)
    scaled = unit(raw, "Length Units", said.get("Length Units", ""), _UNITS, options, "m")
    rate = Finding(
        what="fps",
        value=f"{fps:.6g}",
        why="given" if options.fps else "Export Frame Rate",
        confidence="stated",
        option="fps",
    )
    bones = _of_one(raw, [c for c in columns if c.kind == "Bone"], options)
    if len(bones) >= _LEAST_BONES:
        return _skeleton(raw, columns, values, bones, said, fps, scaled, [rate], options)
    kinds = ("Marker", "Bone Marker")
    owners = sorted({c.name for c in columns if c.kind in kinds})
    tracks = {
        n.split(":")[-1]: _track(columns, values, n, "Position", "XYZ", kinds) for n in owners if "nlabel" not in n
    }
    found = {n: t for n, t in tracks.items() if t is not None}
    if not found:
        raise ClipError(
            raw.name, found=f"no bones and no labelled markers among {len(columns)} columns", expected="a skeleton's bones",
            cure="export with Bones (or Markers) and Positions",
        )  # fmt: skip
    return marker_clip(
        raw,
        dialect=f"Motive CSV, {len(found)} markers",
        fps=fps,
        unit=scaled,
        markers=found,
        options=options,
        findings=[rate],
    )


def _skeleton(
    raw: RawFile, columns: Sequence[_Column], values: ndarray, bones: Sequence[str], said: dict[str, str], fps: float,
    scaled: tuple[float, Finding], findings: Sequence[Finding], options: ReadOptions,
) -> HumanClip:  # fmt: skip
    scale, unit_finding = scaled
    names = [bone.split(":")[-1] for bone in bones]
    tracks = [_track(columns, values, bone, "Position", "XYZ", ("Bone",)) for bone in bones]
    if any(t is None for t in tracks):
        raise ClipError(raw.name, found="bones without positions", expected="them", cure="export Positions too")
    turns = [_track(columns, values, bone, "Rotation", "WXYZ", ("Bone",)) for bone in bones]
    orientations = None
    if said.get("Rotation Type") == "Quaternion" and all(t is not None and np.isfinite(t).all() for t in turns):
        orientations = np.stack([rot.normalise(t) for t in turns if t is not None], axis=1)
    return human_clip(
        raw, dialect=f"Motive CSV, {len(names)} bones", fps=fps, names=names,
        positions=scale * np.stack([t for t in tracks if t is not None], axis=1), orientations=orientations,
        parents=[names.index(_PARENTS[n]) if _PARENTS.get(n) in names else -1 for n in names], options=options,
        unit=unit_finding, findings=findings,
    )  # fmt: skip


def _of_one(raw: RawFile, columns: Sequence[_Column], options: ReadOptions) -> list[str]:
    """Names of the bones of one skeleton: `Ben:LThigh` is Ben's."""
    names = list(dict.fromkeys(c.name for c in columns))
    owners = list(dict.fromkeys(n.rpartition(":")[0] for n in names))
    if len(owners) < 2:
        return names
    owner = owners[one_of_several(owners, raw, options)]
    return [n for n in names if n.rpartition(":")[0] == owner]


def _columns(raw: RawFile, lines: Sequence[str]) -> tuple[list[_Column], int]:
    """Every column behind frame and time by its rows of header, and the line of the titles."""
    rows = list(csv.reader(lines[:_HEADER_LINES]))
    titles = next((i for i, row in enumerate(rows) if row[:1] == ["Frame"]), 0)
    labels = {row[1]: row for row in rows[1:titles] if len(row) > 2 and row[1] in ("Type", "Name", "ID", "Parent")}
    width = len(rows[titles]) if titles else 0
    quantities = rows[titles - 1] if titles else []
    kinds, names = labels.get("Type", []), labels.get("Name", [])
    if width > WIDEST:
        raise ClipError(raw.name, found=f"{width} columns", expected=f"at most {WIDEST}: a body has no more")
    if not titles or any(len(row) != width for row in (kinds, names, quantities)):
        # Before 1.22 the type's row has no title in its second cell.
        raise ClipError(
            raw.name, found="header rows that are not over every column", expected="Type, Name, ID, quantity, Frame",
            cure="export it again from Motive 2 or later, with the header",
        )  # fmt: skip
    cells = zip(kinds[2:], names[2:], quantities[2:], rows[titles][2:], strict=True)
    return [_Column(kind=k.strip(), name=n.strip(), quantity=q.strip(), axis=a.strip()) for k, n, q, a in cells], titles


def _track(
    columns: Sequence[_Column], values: ndarray, name: str, quantity: str, axes: str, kinds: tuple[str, ...]
) -> Float[ndarray, "T n"] | None:
    places = {c.axis: i for i, c in enumerate(columns) if c.name == name and c.quantity == quantity and c.kind in kinds}
    return values[:, [places[a] for a in axes]] if set(axes) <= set(places) else None


def _rate(raw: RawFile, said: dict[str, str], options: ReadOptions) -> float:
    told = said.get("Export Frame Rate", said.get("Capture Frame Rate", ""))
    try:
        return options.fps if options.fps is not None else float(told)
    except ValueError as e:
        raise ClipError(f"{raw.name}, line 1", found=f"a rate of {told!r}", expected="a number", option="fps") from e
