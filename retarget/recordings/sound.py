"""A song under a film, and the light of its beats."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import OutputError
from clips.music import Music
from robot_models import import_or_refuse


@dataclass(frozen=True, kw_only=True, eq=False)
class Soundtrack:
    """What is heard, and when its beats are."""

    song: Path | None = None  # of any format that ffmpeg reads; None: silence
    at_s: float = 0.0  # second of the film at which the song begins; below 0, so many seconds of the song are skipped
    beats_s: Float[ndarray, "B"] = field(default_factory=lambda: np.zeros(0))  # of the film

    @staticmethod
    def of(music: Music, *folders: Path) -> Soundtrack:
        """The song that a reference was made for, where it lies as it was named, or in one of some folders."""
        named = Path(music.song)
        places = [named, *(folder / named.name for folder in folders)] if music.song else []
        song = next((place for place in places if place.is_file()), None)
        return Soundtrack(song=song, at_s=music.song_at_s, beats_s=music.beats_s)

    def light(self, now_s: float) -> float:
        """How bright the light of the beat is: 1 on it, gone a fifth of a second later."""
        past = self.beats_s[self.beats_s <= now_s + 1e-6]
        return float(max(0.0, 1.0 - (now_s - past[-1]) / _FLASH_S)) if len(past) else 0.0


_FLASH_S = 0.2


def encoder() -> Any:
    """The package that brings ffmpeg.

    Raises:
        OutputError: it is not installed.
    """
    cure = "pip install imageio-ffmpeg"
    refusal = OutputError("film", found="no package imageio_ffmpeg", expected="it installed", cure=cure)
    return import_or_refuse("imageio_ffmpeg", refusal)


def check_song(song: Path) -> None:
    """Refuse what is no song before a film is drawn for it.

    Raises:
        OutputError: ffmpeg cannot read it.
    """
    words = [
        encoder().get_ffmpeg_exe(),
        "-v",
        "error",
        "-i",
        str(song),
        "-map",
        "0:a:0",
        "-t",
        "0.5",
        "-f",
        "null",
        "-",
    ]
    _run(words, song)


def add_sound(film: Path, song: Path, at_s: float) -> None:
    """Put a song under a film, which stays as long as it is.

    Args:
        film: pictures, which are copied as they are.
        song: of any format that ffmpeg reads.
        at_s: second of the film at which the song begins; below 0, so many seconds of the song are skipped.

    Raises:
        OutputError: no encoder, or a song that it cannot read.
    """
    skipped = ["-ss", f"{-at_s:.3f}"] if at_s < 0.0 else []
    later = f"adelay={1e3 * at_s:.0f}:all=1," if at_s > 0.0 else ""
    with_sound = film.with_name(f"{film.stem}-sound{film.suffix}")
    words = [
        encoder().get_ffmpeg_exe(), "-v", "error", "-y", "-i", str(film), *skipped, "-i", str(song),
        "-map", "0:v:0", "-map", "1:a:0", "-c:v", "copy", "-c:a", "aac", "-b:a", "192k", "-af", f"{later}apad", "-shortest",
        str(with_sound),
    ]  # fmt: skip
    try:
        _run(words, song)
        with_sound.replace(film)
    finally:
        with_sound.unlink(missing_ok=True)


def _run(words: list[str], song: Path) -> None:
    done = subprocess.run(words, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ["no word"])[-1]
        raise OutputError(
            str(song), found=f"no song that can be read ({said})", expected="a WAV, MP3, M4A, FLAC or OGG"
        )
