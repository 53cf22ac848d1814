"""Changes to a recording: repairs, cuts, other rates, speeds, sides and places."""

from clips.edit.align import placed, recentred
from clips.edit.gaps import without_gaps
from clips.edit.repair import repaired
from clips.edit.resample import cut, new_times, resample, sample
from clips.edit.speed import at_speed, mirrored, warped

__all__ = [
    "at_speed",
    "cut",
    "mirrored",
    "new_times",
    "placed",
    "recentred",
    "repaired",
    "resample",
    "sample",
    "warped",
    "without_gaps",
]
