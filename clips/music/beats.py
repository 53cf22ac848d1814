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
        check_tempo(60.0 / float(np.median(gaps)), self.source)

    @property
    def bpm(self) -> float:
        """Beats per minute, over two bars: single gaps are told in steps of whoever found them."""
        some = min(8, len(self.times_s) - 1)
        return 60.0 * some / float(np.median(self.times_s[some:] - self.times_s[:-some]))


def check_tempo(bpm: float, where: str = "tempo") -> None:
    """Refuse a tempo that no song has.

    Raises:
        ClipError: it is none.
    """
    if not _TEMPI[0] <= bpm <= _TEMPI[1]:
        raise ClipError(
            where, found=f"{bpm:.4g} beats a minute", expected=f"{_TEMPI[0]:.0f} to {_TEMPI[1]:.0f}", option="bpm"
        )


def steady_beats(bpm: float, first_s: float, duration_s: float, song: Path | None = None) -> Beats:
    """Beats of one tempo.

    Args:
        bpm: beats per minute.
        first_s: a beat, from which on there are others; one before the song began stands for the first that is in it [s].
        duration_s: how long the song is [s].
        song: to be heard.

    Raises:
        ClipError: a tempo that no song has, or a first beat after the song's end.
    """
    check_tempo(bpm)
    gap = 60.0 / bpm
    if not -3600.0 <= first_s <= duration_s - 2.0 * gap:
        raise ClipError(
            "first beat",
            found=f"{first_s:g} s",
            expected=f"a second of the song, which ends at {duration_s:.1f}",
            option="first_beat",
        )
    first_s = first_s % gap if first_s < 0.0 else first_s
    return Beats(times_s=np.arange(first_s, duration_s, gap), source="as stated", song=song)


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
    if len(rows) > 2 and all(len(row) > 1 and row[0] == str(int(float(rows[0][0])) + k) for k, row in enumerate(rows)):
        raise ClipError(
            str(path),
            found="beats that are counted in the first column",
            expected="seconds there",
            cure="leave out the numbers",
        )
    return Beats(times_s=np.array([float(row[0]) for row in rows]), source=path.name, song=song)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
