"""C3D: labelled markers of optical systems, by ezc3d; joints from the marker sets of the field."""

from __future__ import annotations

import importlib.util
import io
import re
import struct
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import HumanClip
from clips.errors import ClipError, SeveralClipsError
from clips.provenance import Finding, RawFile, ReadOptions, Repair
from clips.readers.marker_clip import marker_clip
from clips.readers.rates import unit

_INTEL, _MIPS = 84, 86  # their signs in the parameter section
_UNITS = {"millimeters": "mm", "meters": "m", "centimeters": "cm", "in": "inch"}
_BLOCK = 512  # bytes; sections of a C3D begin at whole blocks
_WORKER = Path(__file__).with_name("c3d_worker.py")
_MOST_BYTES = 1 << 30  # of the worker's memory, beside twelve times the file
_MOST_SECONDS = 120.0
_SUBJECT = 6  # markers that share a prefix, from which on it is a person's
_UNLABELLED = re.compile(r"\*.*|(uname|unlabell?ed|traj)\W*\d+|", re.IGNORECASE)


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
    fps, rate = _rate(raw, float(content["rate"]), options)
    scale, unit_finding = unit(raw, "POINT:UNITS", str(next(iter(content["units"]), "")), _UNITS, options, "mm")
    markers, repairs = _markers(_one_subject(raw, content, options))
    if not markers:
        raise ClipError(raw.name, found="no labelled marker", expected="markers with names", cure="label them first")
    return marker_clip(
        raw, dialect=f"C3D, {len(markers)} labelled markers", fps=fps, unit=(scale, unit_finding), markers=markers,
        options=options, findings=[rate], repairs=repairs,
    )  # fmt: skip


def _open(raw: RawFile) -> Mapping[str, ndarray]:
    """What stands in the file, from a process that may come to grief over it."""
    if importlib.util.find_spec("ezc3d") is None:
        raise ClipError(
            raw.name, found="no ezc3d on this machine", expected="it, to open C3D", cure="pip install ezc3d"
        )
    _check_size(raw)
    most = _MOST_BYTES + 12 * len(raw.data)
    command = [sys.executable, str(_WORKER), str(raw.path), str(most)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_MOST_SECONDS, check=False)
    except subprocess.TimeoutExpired as e:
        raise ClipError(raw.name, found="a C3D that takes minutes to open", expected="a whole one") from e
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise ClipError(
            raw.name, found=f"a broken C3D ({said[-1] if said else 'ezc3d crashed'})", expected="a whole one"
        )
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
        content = dict(arrays)
    _check_frames(raw, content["points"].shape[2], content["frames"])
    return content


def _check_frames(raw: RawFile, frames: int, stated: ndarray) -> None:
    _check_size(raw, frames)
    # The parameter is a 16-bit number: longer takes are counted by the header alone.
    if stated.size == 1 and 0 < stated[0] < 0x7FFF and stated[0] != frames:
        raise ClipError(
            raw.name, found=f"{frames} frames in its header and {stated[0]:.0f} in POINT:FRAMES", expected="one number",
            cure="export it again",
        )  # fmt: skip


def _check_size(raw: RawFile, frames: int | None = None) -> None:
    """Refuse a file shorter than its header says, which ezc3d would fill up.

    Words of the header (C3D user guide, "the header section"): points, analog samples per frame, first and last frame,
    scale (below zero: floats), block of the data.
    """
    if len(raw.data) < 2 * _BLOCK:
        raise ClipError(raw.name, found=f"{len(raw.data)} bytes", expected="a C3D's header and parameters")
    parameters = (raw.data[0] - 1) * _BLOCK
    if not 0 <= parameters < len(raw.data) - 3 or raw.data[parameters + 3] != _INTEL:
        _refuse_mips(raw, parameters)
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


def _refuse_mips(raw: RawFile, parameters: int) -> None:
    if 0 <= parameters < len(raw.data) - 3 and raw.data[parameters + 3] == _MIPS:
        raise ClipError(
            raw.name, found="numbers in the byte order of MIPS machines", expected="a C3D in PC (Intel) or DEC order",
            cure="save it again in PC order: Mokka (File, Save As) or Vicon's and Qualisys' export do",
        )  # fmt: skip


def _rate(raw: RawFile, told: float, options: ReadOptions) -> tuple[float, Finding]:
    fps, why = told, "header"
    if options.fps is not None:
        fps, why = options.fps, f"given; the header says {told:.6g}"
    if not (np.isfinite(fps) and fps > 0.0):
        raise raw.no_fps()
    return fps, Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")


def _one_subject(raw: RawFile, content: Mapping[str, ndarray], options: ReadOptions) -> Mapping[str, ndarray]:
    """What belongs to one person: two in one file share their markers' names but for the prefix, and together are nobody."""
    labels = [str(label).strip() for label in content["labels"]][: content["points"].shape[1]]
    counts = Counter(label.split(":")[0] for label in labels if ":" in label)
    subjects = [name for name, count in counts.items() if count >= _SUBJECT]
    chosen = dict(zip(map(str, range(1, len(subjects) + 1)), subjects, strict=True)).get(
        options.person or "", options.person
    )
    if chosen in subjects:
        own = np.flatnonzero([label.startswith(f"{chosen}:") for label in labels])
        points, residuals = content["points"][:, own], content["residuals"][own]
        return {**content, "labels": content["labels"][own], "points": points, "residuals": residuals}
    if len(subjects) > 1 or options.person not in (None, "1"):
        refusal = ClipError if options.person else partial(SeveralClipsError, names=tuple(subjects))
        raise refusal(
            raw.name, found=f"{len(subjects)} subjects ({', '.join(subjects)})", expected="one of them",
            cure="say which, by name or by number", option="person", suggestion="1",
        )  # fmt: skip
    return content


def _markers(content: Mapping[str, ndarray]) -> tuple[dict[str, Float[ndarray, "T 3"]], list[Repair]]:
    """Labelled markers in the file's unit: the subject's prefix off, doubles and computed quantities left out."""
    computed = {str(x).strip() for x in content["computed"]}
    missing = content["residuals"] < 0.0
    found: dict[str, ndarray] = {}
    doubles, unlabelled = 0, 0
    for label, track, lost in zip(content["labels"], np.moveaxis(content["points"], 0, -1), missing, strict=False):
        name = str(label).strip().split(":")[-1]
        if _UNLABELLED.fullmatch(name):
            unlabelled += 1
        elif name in found:
            doubles += 1
        elif str(label).strip() not in computed:
            found[name] = np.where((lost | (track == 0.0).all(axis=-1))[:, None], np.nan, track)
    repairs = []
    if doubles:
        repairs.append(Repair(what="markers left out whose label is there already", count=doubles, of="points"))
    if unlabelled:
        repairs.append(Repair(what="markers without a label left out", count=unlabelled, of="points"))
    return found, repairs
