"""TRC: labelled markers as Motion Analysis, OpenSim, OpenCap and Pose2Sim write them, a text of tabs with five lines of header."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from clips.clip import HumanClip
from clips.errors import ClipError
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers.marker_clip import marker_clip
from clips.readers.rates import unit
from clips.readers.table import number_rows

_UNITS = {"millimeters": "mm", "meters": "m", "centimeters": "cm", "inches": "inch"}
_MOST_MARKERS = 1000


def recognises(raw: RawFile) -> bool:
    """Its first words."""
    return raw.head.lstrip().startswith(b"PathFileType")


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read markers, or joints where they are named so.

    Raises:
        ClipError: a header that lacks its rate, unit or names, or rows of another width.
    """
    lines = raw.text().splitlines()
    if len(lines) < 6:
        raise ClipError(
            raw.name, found=f"{len(lines)} lines", expected="TRC's five lines of header, and a row per frame"
        )
    said = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    names = [name for name in lines[3].strip().split("\t")[2:] if name.strip()]
    if not 0 < len(names) <= _MOST_MARKERS:
        raise ClipError(
            f"{raw.name}, line 4", found=f"{len(names)} names", expected="Frame#, Time and a name per marker"
        )
    values = number_rows(raw, lines, first=5, width=2 + 3 * len(names), separator="\t")
    names = [name.strip().split(":")[-1] for name in names]
    tracks = np.moveaxis(values[:, 2:].reshape(len(values), len(names), 3), 1, 0)
    markers = {name: _seen(track) for name, track in zip(names, tracks, strict=True)}
    fps = _rate(raw, said, options)
    why = "given" if options.fps else "DataRate"
    return marker_clip(
        raw, dialect=f"TRC, {len(names)} markers", fps=fps,
        unit=unit(raw, "Units", said.get("Units", ""), _UNITS, options, "mm"), markers=markers, options=options,
        findings=[Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")],
    )  # fmt: skip


def _seen(track: ndarray) -> ndarray:
    """A marker's track; at the origin in all three it was lost."""
    return np.where((track == 0.0).all(axis=1, keepdims=True), np.nan, track)


def _rate(raw: RawFile, said: dict[str, str], options: ReadOptions) -> float:
    try:
        return options.fps if options.fps is not None else float(said["DataRate"])
    except (KeyError, ValueError) as e:
        raise ClipError(
            f"{raw.name}, line 3", found=said.get("DataRate", "no DataRate"), expected="frames per second", option="fps"
        ) from e
