"""MVNX: Xsens' XML of segments, each with a place and a quaternion wxyz in a world with z up."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import MIN_FRAMES, HumanClip
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers.one_of_several import one_of_several
from robot_models.maths import rotation as rot

_MOST_SEGMENTS = 100
_METRES = Finding(what="unit", value="m", why="MVNX's, by its definition", confidence="stated", option="unit")


def recognises(raw: RawFile) -> bool:
    """The root element."""
    return b"<mvnx" in raw.head


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read the segments of a subject; the poses of calibration are left out.

    Raises:
        ClipError: broken XML or entities, several subjects and none asked for, rows of another width.
    """
    root = _tree(raw)
    subjects = root.findall("{*}subject")
    labels = [s.get("label", f"subject {k + 1}") for k, s in enumerate(subjects)]
    if not subjects:
        raise ClipError(raw.name, found="no subject", expected="MVNX with its subject")
    subject = subjects[one_of_several(labels, raw, options) if len(subjects) > 1 else 0]
    names = [s.get("label", "") for s in subject.iterfind("{*}segments/{*}segment")]
    if not 0 < len(names) <= _MOST_SEGMENTS:
        raise ClipError(f"{raw.name}, segments", found=f"{len(names)} segments", expected=f"1 to {_MOST_SEGMENTS}")
    frames = [f for f in subject.iterfind("{*}frames/{*}frame") if f.get("type", "normal") == "normal"]
    if len(frames) < MIN_FRAMES:
        raise ClipError(raw.name, found=f"{len(frames)} frames of motion", expected=f"at least {MIN_FRAMES}")
    positions = _rows(raw, frames, "position", 3 * len(names)).reshape(len(frames), len(names), 3)
    turned = frames[0].find("{*}orientation") is not None
    turns = _rows(raw, frames, "orientation", 4 * len(names)).reshape(len(frames), len(names), 4) if turned else None
    fps = _rate(raw, subject, options)
    why = "given" if options.fps else "frameRate"
    above = _parents(subject)
    return human_clip(
        raw, dialect=f"MVNX, {len(names)} segments", fps=fps, names=names, positions=positions,
        orientations=None if turns is None else rot.normalise(turns),
        parents=[names.index(above[n]) if above.get(n) in names else -1 for n in names], options=options,
        unit=None if options.unit else _METRES,
        findings=[Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")],
    )  # fmt: skip


def _tree(raw: RawFile) -> ET.Element:
    text = raw.text()
    if "<!ENTITY" in text or "<!DOCTYPE" in text:
        raise ClipError(raw.name, found="XML with entities", expected="plain MVNX", cure="export it again")
    try:
        return ET.fromstring(text.encode())
    except ET.ParseError as e:
        raise ClipError(raw.name, found=f"broken XML ({e})", expected="a whole MVNX", cure="export it again") from e


def _rows(raw: RawFile, frames: list[ET.Element], what: str, width: int) -> Float[ndarray, "T W"]:
    rows = []
    for k, frame in enumerate(frames):
        words = (frame.findtext(f"{{*}}{what}") or "").split()
        try:
            row = np.array(words, dtype=float)
        except ValueError as e:
            raise ClipError(f"{raw.name}, frame {k + 1}, {what}", found="text", expected="numbers") from e
        if len(row) != width or not np.isfinite(row).all():
            raise ClipError(
                f"{raw.name}, frame {k + 1}, {what}", found=f"{len(row)} values", expected=f"{width} finite ones",
                cure="export it with Segment Position and Orientation",
            )  # fmt: skip
        rows.append(row)
    return np.stack(rows)


def _rate(raw: RawFile, subject: ET.Element, options: ReadOptions) -> float:
    try:
        return options.fps if options.fps is not None else float(subject.get("frameRate", ""))
    except ValueError as e:
        raise ClipError(
            f"{raw.name}, frameRate", found=repr(subject.get("frameRate")), expected="a number", option="fps"
        ) from e


def _parents(subject: ET.Element) -> dict[str, str]:
    """Segment -> the one it hangs on: a joint's connectors are `Pelvis/jL5S1` and `L5/jL5S1`."""
    above = {}
    for joint in subject.iterfind("{*}joints/{*}joint"):
        ends = [(joint.findtext(f"{{*}}connector{k}") or "").split("/")[0] for k in (1, 2)]
        if all(ends):
            above[ends[1]] = ends[0]
    return above
