"""A person from labelled markers, whichever file they stand in: joints from the marker sets of the field, or as named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import REQUIRED, HumanClip
from clips.errors import ClipError
from clips.identify import UnknownSkeletonError, human_clip
from clips.provenance import Finding, RawFile, ReadOptions, Repair
from clips.readers.markers import joint_centres

_PARENTS = {
    "hip": "pelvis", "knee": "hip", "ankle": "knee", "toe": "ankle", "neck": "pelvis", "head": "neck", "shoulder": "neck",
    "elbow": "shoulder", "wrist": "elbow",
}  # fmt: skip
_WHOLE_BODY = 24  # markers that may hold what was not recognised: legs alone have 16 to 20


def marker_clip(
    raw: RawFile, *, dialect: str, fps: float, unit: tuple[float, Finding], markers: Mapping[str, Float[ndarray, "T 3"]],
    options: ReadOptions, findings: Sequence[Finding] = (), repairs: Sequence[Repair] = (),
) -> HumanClip:  # fmt: skip
    """Joints from markers of a set known here; else the markers' own names tell parts of the body.

    Args:
        raw: the file.
        dialect: what was recognised.
        fps: frames per second.
        unit: metres per unit of the markers, and what told it.
        markers: name -> positions, NaN where lost.
        options: what the user states.
        findings: what the reader decided before.
        repairs: what the reader mended before.

    Raises:
        ClipError: of the marker set only a part of a body, or no marker set and no names of joints.
    """
    scale, unit_finding = unit
    seen = {name: scale * xyz for name, xyz in markers.items()}
    joints = None if options.mapping else joint_centres(seen)
    if joints is not None:
        _check_whole(raw, list(seen), list(joints[0]))
    points, found = (seen, list(findings)) if joints is None else (joints[0], [*findings, joints[1]])
    names = list(points)
    return human_clip(
        raw, dialect=dialect, fps=fps, names=names, positions=np.stack([points[n] for n in names], axis=1), orientations=None,
        parents=[_parent(n, names) for n in names], options=options, unit=unit_finding, findings=found, repairs=repairs,
    )  # fmt: skip


def _check_whole(raw: RawFile, markers: list[str], found: list[str]) -> None:
    """Refuse a marker set of which only a part of a body is known; a mapping to fill in lists the markers themselves."""
    missing = [k for k in REQUIRED if k not in found]
    if not missing:
        return
    if len(markers) >= _WHOLE_BODY:
        raise UnknownSkeletonError(raw.name, markers, missing, {})
    raise ClipError(
        raw.name, found=f"{len(markers)} markers, none for {', '.join(missing)}", expected="markers of the whole body",
        cure="export the other markers too: a part of a body cannot lead a robot",
    )  # fmt: skip


def _parent(name: str, names: list[str]) -> int:
    side, _, part = name.rpartition("_")
    above = _PARENTS.get(part, "")
    above = f"{side}_{above}" if side and above not in ("pelvis", "neck") else above
    return names.index(above) if above in names and above != name else -1
