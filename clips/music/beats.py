"""`Beats`: when a song's beats are. Stated by tempo or in a table, or found in the song (`song.py`)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.errors import ClipError

_TEMPI = (30.0, 300.0)  # beats per minute that a song may have


@dataclass(frozen=True, kw_only=True, eq=False)
class Beats:
    """The beats of a song."""

    times_s: Float[ndarray, "B"]  # of the song, in order [s]
    source: str  # where they are from, for people
    song: Path | None = None  # to be heard, where there is one

    def __post_init__(self) -> None:
        times = np.asarray(self.times_s, dtype=float)
        gaps = np.diff(times)
        if len(times) < 2 or not np.isfinite(times).all() or not (gaps > 0.0).all():
            raise ClipError(
                self.source, found=f"{len(times)} beats" if len(times) < 2 else "beats out of order",
                expected="two or more times in seconds, each after the one before",
            )  # fmt: skip
        object.__setattr__(self, "times_s", times)
        tempo = 60.0 / float(np.median(gaps))
        if not _TEMPI[0] <= tempo <= _TEMPI[1]:
            raise ClipError(
                self.source, found=f"{tempo:.4g} beats a minute", expected=f"{_TEMPI[0]:.0f} to {_TEMPI[1]:.0f}"
            )

    @property
    def bpm(self) -> float:
        """Beats per minute: of the median gap."""
        return 60.0 / float(np.median(np.diff(self.times_s)))


def steady_beats(bpm: float, first_s: float, duration_s: float, song: Path | None = None) -> Beats:
    """Beats of one tempo.

    Args:
        bpm: beats per minute.
        first_s: the first beat [s].
        duration_s: until when [s].
        song: to be heard.

    Raises:
        ClipError: a tempo that no song has.
    """
    if not _TEMPI[0] <= bpm <= _TEMPI[1]:
        raise ClipError(
            "tempo", found=f"{bpm:g} beats a minute", expected=f"{_TEMPI[0]:.0f} to {_TEMPI[1]:.0f}", option="bpm"
        )
    gap = 60.0 / bpm
    return Beats(
        times_s=np.arange(first_s, max(first_s + 2.5 * gap, duration_s), gap), source=f"{bpm:g} bpm", song=song
    )


def read_beats(path: Path, song: Path | None = None) -> Beats:
    """Beats from a text file: seconds in the first column, as beat trackers and editors (Audacity's labels) write them.

    Raises:
        ClipError: no such file, or no times in it.
    """
    try:
        rows = [line.replace(",", " ").replace(";", " ").split() for line in path.read_text("utf-8-sig").splitlines()]
    except (OSError, UnicodeDecodeError) as e:
        raise ClipError(str(path), found=str(e), expected="a text file of beats, one a line, in seconds") from e
    rows = [row for row in rows if row and not row[0].startswith("#")]
    if rows and not _is_number(rows[0][0]):
        rows = rows[1:]  # names of columns
    for number, row in enumerate(rows, start=1):
        if not _is_number(row[0]):
            raise ClipError(str(path), found=f"beat {number}: {row[0][:40]!r}", expected="a time in seconds")
    return Beats(times_s=np.array([float(row[0]) for row in rows]), source=path.name, song=song)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
