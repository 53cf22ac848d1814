"""`Music`: the song that a reference is danced to, in the reference's own time, and how near its accents are to the beats."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.music.accents import Accents
from clips.music.beats import Beats
from clips.reference import Reference


@dataclass(frozen=True, kw_only=True, eq=False)
class Music:
    """A song beside a reference."""

    beats_s: Float[ndarray, "B"]  # of the reference: 0 is its first frame [s]
    song_at_s: float  # second of the reference at which the song begins; below 0: so much of it is skipped
    song: str = ""  # its file, where there is one
    source: str = ""  # where the beats are from

    @property
    def bpm(self) -> float | None:
        """Beats per minute; None of fewer than two."""
        return None if len(self.beats_s) < 2 else Beats(times_s=self.beats_s, source=self.source).bpm

    def as_meta(self) -> dict[str, Any]:
        """For the reference's file."""
        told = {"song": self.song, "source": self.source, "song_at_s": round(self.song_at_s, 4)}
        return told | {"beats_s": [round(float(t), 4) for t in self.beats_s]}


def music_of(reference: Reference) -> Music | None:
    """The song that a reference was made for, if there is one."""
    told = reference.meta.get("music")
    if not isinstance(told, Mapping):
        return None
    return Music(
        beats_s=np.asarray(told["beats_s"], dtype=float), song_at_s=float(told["song_at_s"]),
        song=str(told["song"]), source=str(told["source"]),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class BeatError:
    """How far the nearest accent of a dance is from each beat of its song."""

    median_ms: float
    p95_ms: float
    on_beat: float  # share of the beats with an accent within 40 ms, of those that are danced to


_ON_BEAT_MS = 40.0


def beat_error(accents: Accents, beats_s: Float[ndarray, "B"], duration_s: float) -> BeatError | None:
    """The beat error of a dance; None of one that has no accent near a beat.

    Args:
        accents: of the dance.
        beats_s: in the same time, 0 at the dance's first frame [s]. Those before it and after its end do not count, and none
            that has no accent within a beat's length: the dancer rests.
        duration_s: of the dance [s].
    """
    danced = beats_s[(beats_s >= 0.0) & (beats_s <= duration_s)]
    if len(beats_s) < 2 or not len(accents.times_s):
        return None
    off = 1e3 * np.abs(danced[:, None] - accents.times_s).min(axis=1)
    off = off[off <= 1e3 * np.median(np.diff(beats_s))]
    if not len(off):
        return None
    return BeatError(
        median_ms=float(np.median(off)),
        p95_ms=float(np.percentile(off, 95)),
        on_beat=float((off <= _ON_BEAT_MS).mean()),
    )
