"""What is stated about the song that a dance is danced to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from clips import ClipError
from clips.music import Beats, MusicConfig, check_tempo, duration_of, find_beats, read_beats, steady_beats
from robot_models.maths import Progress

_NO_SONG_S = 3600.0  # of beats where there is a tempo and no song


@dataclass(frozen=True, kw_only=True)
class SongOptions:
    """The song that it is danced to: at a pace that lands its accents on the beats."""

    music: Path | None = None
    """A song (WAV, FLAC, OGG, MP3), whose beats are found in it unless they are stated."""
    bpm: float | None = None
    """Its tempo: with --first-beat the beats are known, without it helps to find them."""
    first_beat: float | None = None
    """Second of the song at which its first beat is."""
    beats: Path | None = None
    """A table of its beats, one a line, in seconds."""
    music_start: float | None = None
    """Second of the song at which the dance begins; default: near its first beat, where it fits best."""
    stretch: float = MusicConfig.stretch
    """Largest change of pace, 0 to 0.5: 0.15 is 15 % slower or faster than recorded."""

    @property
    def given(self) -> bool:
        """Whether there is music."""
        return self.music is not None or self.bpm is not None or self.beats is not None

    def check(self) -> None:
        """Refuse what cannot go together.

        Raises:
            ClipError: options that contradict each other, or have nothing to speak of.
        """
        if not self.given:
            lone: dict[str, float | None] = {"--first-beat": self.first_beat, "--music-start": self.music_start}
            lone["--stretch"] = self.stretch if self.stretch != MusicConfig.stretch else None
            for name, value in lone.items():
                if value is not None:
                    raise ClipError(name, found="no music beside it", expected="--music, --bpm or --beats")
        if self.beats is not None and (self.bpm is not None or self.first_beat is not None):
            raise ClipError(
                "--beats", found="--bpm or --first-beat beside it", expected="one way to say when beats are"
            )
        if self.music is None and self.bpm is not None and self.first_beat is None:
            raise ClipError(
                "--bpm", found="no --first-beat and no song", expected="when the first beat is",
                option="first_beat", suggestion="0",
            )  # fmt: skip
        if self.bpm is None and self.first_beat is not None:
            raise ClipError(
                "--first-beat", found="no tempo beside it", expected="--bpm, from which the other beats follow"
            )
        if self.bpm is not None:
            check_tempo(self.bpm, "--bpm")
        if self.music is not None and not self.music.is_file():
            found = "a folder" if self.music.is_dir() else "no such file"
            raise ClipError(f"--music {self.music}", found=found, expected="a song")
        if self.music_start is not None and not self.music_start >= 0.0:
            raise ClipError("--music-start", found=f"{self.music_start:g}", expected="a second of the song, from 0 on")
        if 1.0 < self.stretch <= 50.0:
            percent = f"{self.stretch / 100:g}"
            raise ClipError(
                "--stretch", found=f"{self.stretch:g}", expected="0 to 0.5", option="stretch", suggestion=percent
            )
        self.config()

    def config(self) -> MusicConfig:
        """How far the pace may change."""
        return MusicConfig(stretch=self.stretch)

    def find(self, progress: Progress) -> Beats:
        """The beats, as stated or found.

        Raises:
            ClipError: they cannot be.
        """
        if self.beats is not None:
            return read_beats(self.beats, self.music)
        if self.bpm is not None and self.first_beat is not None:
            length_s = None if self.music is None else duration_of(self.music)
            return steady_beats(self.bpm, self.first_beat, length_s or _NO_SONG_S, self.music)
        assert self.music is not None
        return find_beats(self.music, self.bpm, progress=progress)
