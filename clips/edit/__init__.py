"""Changes to a recording: repairs, cuts, other rates, speeds, sides and places."""

from clips.edit.align import placed, recentre
from clips.edit.false_ends import left_out_at_start
from clips.edit.gaps import without_gaps
from clips.edit.repair import repair
from clips.edit.resample import cut, new_times, resample, sample, sample_quat
from clips.edit.sides import exchanged_everywhere
from clips.edit.speed import at_speed, mirror, warp_time
from clips.edit.travel import travel_from_feet, travel_scaled

__all__ = [
    "at_speed",
    "cut",
    "exchanged_everywhere",
    "left_out_at_start",
    "mirror",
    "new_times",
    "placed",
    "recentre",
    "repair",
    "resample",
    "sample",
    "sample_quat",
    "travel_from_feet",
    "travel_scaled",
    "warp_time",
    "without_gaps",
]
