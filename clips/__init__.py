"""Recorded motion: read, recognise, check, resample; the `Clip` and `Reference` types and their files."""

from clips.clip import OPTIONAL, REQUIRED, Clip, HumanClip, RobotClip, full_qpos
from clips.contact import ContactRule, floor_nearby, heights_and_speeds, own_floor
from clips.edit import at_speed, cut, mirror, repair, resample, warp_time
from clips.errors import ClipError, ReferenceFileError
from clips.files import OutputError, aside, folder_aside, write_whole
from clips.metrics import MetricKey, metric_key, metric_label
from clips.provenance import Finding, Provenance, ReadOptions, Repair
from clips.readers import clip_stem, clips_in, file_and_name, read_clip, read_of_several
from clips.reference import FREE, GLIDING, PIVOTING, PLANTED, Reference, make_reference
from clips.reference_file import check_reference_against, is_reference, load_reference, save_reference
from clips.writers import LAYOUTS, read_back, write_motion
from robot_models import __version__

__all__ = [
    "FREE",
    "GLIDING",
    "LAYOUTS",
    "OPTIONAL",
    "PIVOTING",
    "PLANTED",
    "REQUIRED",
    "Clip",
    "ClipError",
    "ContactRule",
    "Finding",
    "HumanClip",
    "MetricKey",
    "OutputError",
    "Provenance",
    "ReadOptions",
    "Reference",
    "ReferenceFileError",
    "Repair",
    "RobotClip",
    "__version__",
    "aside",
    "at_speed",
    "check_reference_against",
    "clip_stem",
    "clips_in",
    "cut",
    "file_and_name",
    "floor_nearby",
    "folder_aside",
    "full_qpos",
    "heights_and_speeds",
    "is_reference",
    "load_reference",
    "make_reference",
    "metric_key",
    "metric_label",
    "mirror",
    "own_floor",
    "read_back",
    "read_clip",
    "read_of_several",
    "repair",
    "resample",
    "save_reference",
    "warp_time",
    "write_motion",
    "write_whole",
]
