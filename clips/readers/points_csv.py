"""CSV of named points: `<name>_x, <name>_y, <name>_z` per point, any order, with or without a time column."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from clips.clip import HumanClip
from clips.identify import find_landmarks, human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers import table

_AXIS = re.compile(r"^(.+?)[ _.\-]?([xyzXYZ])(?:\s*\(\w+\))?$")
_MIN_POINTS = 6
# Bones to draw; the parent of a landmark that stands alone in a file without a hierarchy.
_PARENT = {
    "knee": "hip", "ankle": "knee", "toe": "ankle", "elbow": "shoulder", "wrist": "elbow",
}  # fmt: skip


def recognises(raw: RawFile) -> bool:
    """A header with the x, y, z of at least six points, and no robot joints."""
    if not table.looks_like_table(raw):
        return False
    return len(_triples(table.header(raw))) >= _MIN_POINTS


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read named points.

    Raises:
        ClipError: no frame rate, or no person among the points.
    """
    data = table.parse(raw, named_points=True)
    fps = options.fps or data.fps
    if fps is None:
        raise raw.no_fps()
    triples = _triples(data.columns)
    positions = np.stack([data.values[:, list(triples[n])] for n in triples], axis=1)
    names = tuple(triples)
    why = "given" if options.fps else data.fps_why
    rate = Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")
    return human_clip(
        raw,
        dialect=f"CSV of {len(names)} named points",
        fps=fps,
        names=names,
        positions=positions,
        orientations=None,
        parents=_parents(names),
        options=options,
        repairs=data.repairs,
        findings=[
            rate,
            *(Finding(what="text layout", value=n, why="seen in its lines", confidence="measured") for n in data.notes),
        ],
    )


def _triples(columns: Sequence[str]) -> dict[str, tuple[int, int, int]]:
    """Point name -> columns of its x, y, z, in the order of the file."""
    found: dict[str, dict[str, int]] = defaultdict(dict)
    for i, column in enumerate(columns):
        match = _AXIS.match(column.strip())
        if match:
            found[match.group(1)][match.group(2).lower()] = i
    whole = {n: (c["x"], c["y"], c["z"]) for n, c in found.items() if len(c) == 3}
    robot_words = re.compile(r"^root|rotat|quat|_rot$|^(pelvis|base)_(pos|rot)", re.IGNORECASE)
    return {n: c for n, c in whole.items() if not robot_words.search(n)}


def _parents(names: Sequence[str]) -> list[int]:
    known = find_landmarks(names)
    parents = [-1] * len(names)
    for landmark, name in known.items():
        side, _, part = landmark.rpartition("_")
        above = known.get(f"{side}_{_PARENT[part]}") if part in _PARENT else None
        if part in ("hip", "shoulder"):
            above = known.get("pelvis" if part == "hip" else "neck") or known.get("chest")
        elif part in ("chest", "neck", "head"):
            above = known.get({"chest": "pelvis", "neck": "chest", "head": "neck"}[part])
        if above and above != name:
            parents[names.index(name)] = names.index(above)
    return parents
