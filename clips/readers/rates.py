"""Frame rates and units that a file or the user states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy import ndarray

from clips.errors import ClipError
from clips.provenance import UNITS, Finding, RawFile, ReadOptions


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


def unit(
    raw: RawFile, where: str, told: str, customs: Mapping[str, str], options: ReadOptions, suggestion: str
) -> tuple[float, Finding]:
    """Metres per unit, from the options or the word in the file.

    Args:
        raw: the file.
        where: in it the word stands.
        told: the word.
        customs: words of this kind of file -> a unit of `UNITS`, or metres as a number.
        options: what the user states.
        suggestion: a unit worth trying where the word is none.

    Raises:
        ClipError: a word that is no unit, and none stated.
    """
    word = told.strip().lower()
    name = options.unit or customs.get(word, word)
    if options.unit is None and name not in UNITS and name not in customs.values():
        raise ClipError(
            f"{raw.name}, {where}", found=repr(told), expected="the unit of its positions", cure="state it", option="unit",
            suggestion=suggestion,
        )  # fmt: skip
    scale = UNITS[name] if name in UNITS else float(name)
    why = "given" if options.unit else where
    return scale, Finding(what="unit", value=name, why=why, confidence="stated", option="unit")
