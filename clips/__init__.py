"""Recorded motion: read, recognise, check, resample; the `Clip` and `Reference` types and their files."""

from clips.clip import Clip, HumanClip, RobotClip
from clips.edit import at_speed, cut, mirrored, repaired, resample, warped
from clips.errors import ClipError, ReferenceFileError
from clips.files import OutputError
from clips.identify import full_qpos
from clips.readers import read_clip
from clips.reference import FREE, PIVOTING, PLANTED, Reference, load_reference, make_reference, save_reference
from clips.source import ClipSource, Finding, ReadOptions, Repair

__all__ = [
    "FREE",
    "PIVOTING",
    "PLANTED",
    "Clip",
    "ClipError",
    "ClipSource",
    "Finding",
    "HumanClip",
    "OutputError",
    "ReadOptions",
    "Reference",
    "ReferenceFileError",
    "Repair",
    "RobotClip",
    "at_speed",
    "cut",
    "full_qpos",
    "load_reference",
    "make_reference",
    "mirrored",
    "read_clip",
    "repaired",
    "resample",
    "save_reference",
    "warped",
]
