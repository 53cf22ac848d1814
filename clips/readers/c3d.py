"""C3D: labelled markers of optical systems, by ezc3d; joints from the marker sets of the field."""

from __future__ import annotations

import re
import struct
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import HumanClip
from clips.errors import ClipError
from clips.human import human_clip
from clips.markers import joint_centres
from clips.source import UNITS, Finding, RawFile, ReadOptions, Repair

_PARENTS = {
    "hip": "pelvis", "knee": "hip", "ankle": "knee", "toe": "ankle", "shoulder": "pelvis", "elbow": "shoulder",
    "wrist": "elbow", "head": "pelvis",
}  # fmt: skip
_COMPUTED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")  # POINT groups that are no places
_INTEL = 84  # its sign in the parameter section
_BLOCK = 512  # bytes; sections of a C3D begin at whole blocks


def recognises(raw: RawFile) -> bool:
    """The key 0x50 behind the number of the parameter section's block."""
    return raw.path.suffix.lower() == ".c3d" or (
        len(raw.data) > _BLOCK and raw.data[0] in (2, 3) and raw.data[1] == 0x50
    )


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read labelled markers and compute joints from them.

    Raises:
        ClipError: ezc3d is not installed, a broken or cut file, no rate or unit, no marker set and no names of joints.
    """
    content = _open(raw)
    point = {k: v["value"] for k, v in content["parameters"]["POINT"].items() if "value" in v}
    fps, rate = _rate(raw, content, options)
    unit, unit_finding = _unit(raw, point, options)
    markers, repairs = _markers(content, point)
    seen = {name: unit * xyz for name, xyz in markers.items()}
    joints = None if options.mapping else joint_centres(seen)
    points, findings = (seen, [rate]) if joints is None else (joints[0], [rate, joints[1]])
    if not points:
        raise ClipError(raw.name, found="no labelled marker", expected="markers with names", cure="label them first")
    names = list(points)
    return human_clip(
        raw,
        dialect=f"C3D, {len(markers)} labelled markers",
        fps=fps,
        names=names,
        positions=np.stack([points[n] for n in names], axis=1),
        orientations=None,
        parents=[_parent(n, names) for n in names],
        options=options,
        unit=unit_finding,
        findings=findings,
        repairs=repairs,
    )


def _open(raw: RawFile) -> Any:
    try:
        import ezc3d
    except ImportError as e:
        raise ClipError(
            raw.name, found="no ezc3d on this machine", expected="it, to open C3D", cure="pip install ezc3d"
        ) from e  # fmt: skip
    _check_size(raw)
    try:
        content = ezc3d.c3d(str(raw.path))
    except Exception as e:  # its C++ reader raises OSError, ValueError, RuntimeError, whatever stands in the bytes
        raise ClipError(raw.name, found=f"a broken C3D ({e})", expected="a whole one") from e
    point = content["parameters"].get("POINT", {})
    stated = np.ravel(point.get("FRAMES", {}).get("value", ()))
    frames = content["data"]["points"].shape[2]
    _check_size(raw, frames)
    # The parameter is a 16-bit number: longer takes are counted by the header alone.
    if stated.size == 1 and 0 < int(stated[0]) < 0x7FFF and int(stated[0]) != frames:
        raise ClipError(
            raw.name, found=f"{frames} frames in its header and {int(stated[0])} in POINT:FRAMES",
            expected="one number", cure="export it again",
        )  # fmt: skip
    return content


def _check_size(raw: RawFile, frames: int | None = None) -> None:
    """Refuse a file shorter than its header says, which ezc3d would fill up.

    Words of the header (C3D user guide, "the header section"): points, analog samples per frame, first and last frame,
    scale (below zero: floats), block of the data.
    """
    if len(raw.data) < 2 * _BLOCK:
        raise ClipError(raw.name, found=f"{len(raw.data)} bytes", expected="a C3D's header and parameters")
    parameters = (raw.data[0] - 1) * _BLOCK
    if parameters + 4 > len(raw.data) or raw.data[parameters + 3] != _INTEL:
        return  # another byte order: left to ezc3d
    points, analog, first, last = struct.unpack_from("<HHHH", raw.data, 2)
    scale, block = struct.unpack_from("<fH", raw.data, 12)
    frames = last - first + 1 if frames is None else frames
    need = (block - 1) * _BLOCK + frames * (4 * points + analog) * (4 if scale < 0.0 else 2)
    if need > len(raw.data):
        raise ClipError(
            raw.name, found=f"{len(raw.data)} bytes", expected=f"{need} for {frames} frames of {points} points",
            cure="the file is cut off: copy or export it again",
        )  # fmt: skip


def _rate(raw: RawFile, content: Any, options: ReadOptions) -> tuple[float, Finding]:
    fps, why = float(content["header"]["points"]["frame_rate"]), "header"
    if options.fps is not None:
        fps, why = options.fps, f"given; the header says {fps:.6g}"
    if not (np.isfinite(fps) and fps > 0.0):
        raise raw.no_fps()
    return fps, Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")


def _unit(raw: RawFile, point: dict[str, Any], options: ReadOptions) -> tuple[float, Finding]:
    """Metres per unit, as POINT:UNITS says."""
    told = str(next(iter(point.get("UNITS", ())), "")).strip().lower()
    name = options.unit or {"millimeters": "mm", "meters": "m", "centimeters": "cm"}.get(told, told)
    if name in UNITS or options.unit is not None:
        scale = UNITS[name] if name in UNITS else float(name)
        why = "given" if options.unit else "POINT:UNITS"
        return scale, Finding(what="unit", value=name, why=why, confidence="stated", option="unit")
    raise ClipError(
        f"{raw.name}, POINT:UNITS", found=repr(told), expected="the unit of its positions", cure="state it",
        option="unit", suggestion="mm",
    )  # fmt: skip


def _markers(content: Any, point: dict[str, Any]) -> tuple[dict[str, Float[ndarray, "T 3"]], list[Repair]]:
    """Labelled markers in the file's unit: the subject's prefix off, doubles and computed quantities left out."""
    # ezc3d spreads more than 255 labels over LABELS, LABELS2 ...
    groups = sorted((k for k in point if re.fullmatch(r"LABELS\d*", k)), key=lambda k: int(k[6:] or 1))
    labels = [str(label).strip() for k in groups for label in point[k]]
    computed = {str(x).strip() for k in _COMPUTED for x in point.get(k, ())}
    xyz = np.moveaxis(content["data"]["points"][:3], 0, -1)
    missing = content["data"]["meta_points"]["residuals"][0] < 0.0
    found: dict[str, ndarray] = {}
    doubles, unlabelled = 0, 0
    for label, track, lost in zip(labels, xyz, missing, strict=False):
        name = label.split(":")[-1]
        if not name or name.startswith("*") or re.fullmatch(r"(uname|unlabeled|unlabelled|traj)\W*\d+", name, re.I):
            unlabelled += 1
        elif name in found or label in computed:
            doubles += name in found
        else:
            found[name] = np.where((lost | (track == 0.0).all(axis=-1))[:, None], np.nan, track)
    repairs = []
    if doubles:
        repairs.append(Repair(what="markers left out whose label is there already", count=doubles, of="points"))
    if unlabelled:
        repairs.append(Repair(what="markers without a label left out", count=unlabelled, of="points"))
    return found, repairs


def _parent(name: str, names: list[str]) -> int:
    side, _, part = name.rpartition("_")
    above = _PARENTS.get(part, "")
    above = f"{side}_{above}" if side and above != "pelvis" else above
    return names.index(above) if above in names and above != name else -1
