"""Shared recordings at their rates; the mistakes that are put into them are of `clips.samples.mistakes`."""

from functools import cache

from clips import ReadOptions, read_clip
from clips.edit import cut
from clips.samples import exchanged, tilted, travelling, with_rest

__all__ = ["RATES", "exchanged", "read_shared", "tilted", "travelling", "with_rest"]

RATES = {"csv/g1moves": 60.0, "csv/g1_": 60.0, "csv/lafan1": 30.0, "amc/": 120.0}
"""Frames per second of shared files that do not say theirs, by how their names begin."""


def read_shared(shared, file, start=None, end=None):
    """A shared recording at its rate, or a part of it [s]."""
    clip = _read(shared / file, next((rate for name, rate in RATES.items() if file.startswith(name)), None))
    return clip if start is None else cut(clip, start, end)


@cache
def _read(path, fps):
    return read_clip(path, ReadOptions(fps=fps))
