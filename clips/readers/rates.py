"""Frame rates of files of named arrays: as stated, or by the first key that is there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy import ndarray

from clips.errors import ClipError
from clips.provenance import Finding, RawFile, ReadOptions


def rate(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions, *keys: str) -> tuple[float, Finding]:
    """Frame rate from the options or the first key that is there."""
    if options.fps is not None:
        return options.fps, Finding(
            what="fps", value=f"{options.fps:.6g}", why="given", confidence="stated", option="fps"
        )
    for key in keys:
        if key in data and np.size(data[key]) == 1:
            try:
                fps = float(np.reshape(data[key], -1)[0])
            except ValueError as e:
                raise ClipError(f"{raw.name}, {key}", found=repr(data[key]), expected="frames per second") from e
            return fps, Finding(what="fps", value=f"{fps:.6g}", why=f"key '{key}'", confidence="stated", option="fps")
    raise raw.no_fps()
