"""Mathematics that knows no robot: rotations, arrays, intervals of frames, smoothing, banded systems, threads, progress."""

from robot_models.maths import rotation
from robot_models.maths.arrays import Array, array_namespace, push_history, to_numpy
from robot_models.maths.banded import HALF_BANDWIDTH, BandedSystem, Memory, band_memory, difference_transposed, dilate
from robot_models.maths.intervals import away_from, close_gaps, intervals_of, nearest
from robot_models.maths.progress import Progress, silent
from robot_models.maths.smoothing import smooth
from robot_models.maths.threads import available_threads, one_blas_thread

__all__ = [
    "HALF_BANDWIDTH",
    "Array",
    "BandedSystem",
    "Memory",
    "Progress",
    "array_namespace",
    "available_threads",
    "away_from",
    "band_memory",
    "close_gaps",
    "difference_transposed",
    "dilate",
    "intervals_of",
    "nearest",
    "one_blas_thread",
    "push_history",
    "rotation",
    "silent",
    "smooth",
    "to_numpy",
]
