"""The door: any motion file in, a checked `Clip` out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

from clips.checks import likely_rate, sway_ratio
from clips.clip import Clip, HumanClip
from clips.config import SWAY
from clips.edit import travel_from_feet, travel_scaled
from clips.errors import ClipError, SeveralClipsError
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers import (
    amc,
    bvh,
    c3d,
    deepmimic,
    glb,
    motive_csv,
    mvnx,
    npz,
    numpy_array,
    pickles,
    points_csv,
    robot_csv,
    torch_motion,
    trc,
    vmd,
)
from clips.readers.one_of_several import file_and_name, refuse_another

# Asked in this order; the first that recognises the content reads it.
READERS: tuple[ModuleType, ...] = (
    bvh, amc, deepmimic, c3d, npz, numpy_array, torch_motion, pickles, glb, mvnx, vmd, trc, motive_csv, points_csv,
    robot_csv,
)  # fmt: skip

_SEVERAL = (
    bvh,
    c3d,
    npz,
    numpy_array,
    torch_motion,
    pickles,
    glb,
    mvnx,
    motive_csv,
)  # which may hold several people or clips

_KNOWN_ELSEWHERE = {
    b"Kaydara FBX": ("an FBX file", "open it in Blender and export BVH"),
    b"; FBX": ("an FBX file (text)", "open it in Blender and export BVH"),
    b"RRF": ("a Rerun recording", "give the reference (.npz) that was written beside it"),
    b":ASF": ("an ASF skeleton", "give the AMC motion; it finds the ASF beside it"),
    b"!OML:ASF": ("an ASF skeleton", "give the AMC motion; it finds the ASF beside it"),
}


_EXPECTED = "CSV, PKL, NPZ, NPY, BVH, C3D, AMC, TRC, MVNX, GLB, VMD, torch's .pt or DeepMimic's txt"
_FILMS = b"ftyp", b"matroska", b"webm", b"AVI LIST"  # among the first bytes


def read_clip(path: Path | str, options: ReadOptions | None = None) -> Clip:
    """Read a motion file, chosen by its content.

    Args:
        path: the file; FILE#2 for the second of several people in it.
        options: what the user states about it; a statement beats every guess.

    Raises:
        ClipError: the file cannot be read rightly; the message names place, found, expected and cure.
    """
    path, options = _person_of(Path(path), options or ReadOptions())
    raw = RawFile.load(path)
    for reader in READERS:
        if reader.recognises(raw):
            if reader not in _SEVERAL:
                refuse_another(raw, options)
            return _as_stated(_beside_its_own(_read(reader, raw, options), reader, raw, options), options)
    if b"endheader" in raw.head:
        cure = "give the TRC that it was solved from"
        raise ClipError(raw.name, found="OpenSim's angles of a model", expected="where somebody was", cure=cure)
    for magic, (what, cure) in _KNOWN_ELSEWHERE.items():
        if raw.head.lstrip().startswith(magic):
            raise ClipError(raw.name, found=what, expected=_EXPECTED, cure=cure)
    if any(magic in raw.head[:64] for magic in _FILMS):
        raise ClipError(
            raw.name, found="a film", expected="the motion of a body",
            cure="a pose estimator makes one of it: its SMPL parameters (.npz, .pkl) or its named points (.csv) are read",
        )  # fmt: skip
    raise ClipError(
        raw.name,
        found=f"content that no reader knows (it begins with {raw.head[:16]!r})",
        expected=_EXPECTED,
        cure="docs/formats.md lists every layout",
    )


def clips_in(path: Path, options: ReadOptions | None = None) -> list[Path]:
    """Every clip or person of a file, as FILE#NAME (FILE#2 where names repeat or are no names of files); itself where it holds one.

    Args:
        path: the file.
        options: what is stated about it.

    Raises:
        ClipError: as `read_clip`, but of one that holds several.
    """
    try:
        read_clip(path, options)
    except SeveralClipsError as e:
        plain = len(set(e.names)) == len(e.names) and not any("/" in name or "\\" in name for name in e.names)
        return [Path(f"{path}#{name if plain else k + 1}") for k, name in enumerate(e.names)]
    return [path]


def read_of_several(path: Path | str, options: ReadOptions) -> Clip:
    """One of several files: what is stated about the rate holds for those that do not say theirs.

    Args:
        path: as for `read_clip`.
        options: what is stated about all of them.

    Raises:
        ClipError: as `read_clip`.
    """
    try:
        return read_clip(path, replace(options, fps=None))
    except ClipError as e:
        if e.option != "fps" or options.fps is None:
            raise
    return read_clip(path, options)


def _read(reader: ModuleType, raw: RawFile, options: ReadOptions) -> Clip:
    """What a reader makes of a file; of one that does not say its rate, a refusal with the rate that its motion fits."""
    try:
        return reader.read(raw, options)
    except ClipError as e:
        if e.option != "fps" or options.fps is not None:
            raise
        rate = _likely_rate(reader, raw, options)
        if rate is None:
            raise
        how = f"at {rate:g} frames per second the body sways over its standing feet as gravity has it"
        raise ClipError(
            e.where, found=f"{e.found}; {how}", expected=e.expected, cure=e.cure, option="fps", suggestion=f"{rate:g}"
        ) from None


def _likely_rate(reader: ModuleType, raw: RawFile, options: ReadOptions) -> float | None:
    """The rate at which a file's body moves as bodies do; None where that is not clear, or something else is wrong."""
    try:
        return likely_rate({fps: sway_ratio(reader.read(raw, replace(options, fps=fps))) for fps in SWAY.rates})
    except ClipError:
        return None


def _beside_its_own(clip: Clip, reader: ModuleType, raw: RawFile, options: ReadOptions) -> Clip:
    """The clip; with a doubt where the rate that was stated is another than the file's own."""
    if options.fps is None:
        return clip
    try:
        own = reader.read(raw, replace(options, fps=None)).fps
    except ClipError:
        return clip
    if abs(own - options.fps) < 0.01 * own:
        return clip
    found = Finding(
        what="stated rate", value=f"{options.fps:g}", why=f"the file itself says {own:.6g}", confidence="assumed"
    )
    return replace(clip, source=replace(clip.source, findings=(*clip.source.findings, found)))


def _person_of(path: Path, options: ReadOptions) -> tuple[Path, ReadOptions]:
    """`FILE#2` is the second person or clip of a file, `FILE#NAME` the one of that name."""
    file, asked = file_and_name(path)
    if not asked:
        return path, options
    if options.person not in (None, asked):
        raise ClipError(
            str(path), found=f"person '{options.person}' beside it", expected="one of the two", option="person"
        )
    return file, replace(options, person=asked)


def _as_stated(clip: Clip, options: ReadOptions) -> Clip:
    """The clip with the travel that the user states, and a floor that stays where it shall."""
    if options.level is False:
        floor = Finding(what="floor", value="left as it is", why="given", confidence="stated", option="level")
        clip = replace(clip, source=replace(clip.source, findings=(*clip.source.findings, floor)))
    if options.travel is not None or options.travel_scale is not None:
        said = options.travel or f"x {options.travel_scale:g}"
        travel = Finding(what="travel", value=said, why="given", confidence="stated", option="travel_scale")
        clip = replace(clip, source=replace(clip.source, findings=(*clip.source.findings, travel)))
    if options.travel_scale is not None and isinstance(clip, HumanClip):  # a robot's root is checked against its floor
        clip = travel_scaled(clip, options.travel_scale)
    return travel_from_feet(clip) if options.travel == "from-feet" else clip
