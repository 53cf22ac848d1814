"""A film of a policy or a reference."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cli.shell import progress
from clips import OutputError

if TYPE_CHECKING:
    from retarget.recordings import Shot, Soundtrack
    from tracking.evaluation import PoseStream

_APART = -1.2  # from the robot to its reference, where one stands beside the other, in y [m]


@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """A film instead of a window."""

    film: Path | None = None
    """Write a film (.mp4) and open no window; for machines without a display."""
    audio: Path | None = None
    """A song to be heard in the film; default: the one that the reference was made for, where it still lies."""
    audio_at: float | None = None
    """Second of the film at which the song begins; default: as the reference says, else where the dance does. Below 0: so
    many of the song are skipped."""
    ghost: bool = True
    """Show where the reference is, pale, in the film."""
    beside: bool = False
    """Show the reference beside the robot in the film, instead of as its ghost."""
    width: int = 960
    """Of the film, in pixels."""
    height: int = 720
    """Of the film, in pixels."""

    def check(self) -> None:
        """Refuse what is no film, or has none to be heard in.

        Raises:
            OutputError: a name that is no film's, a song without a film, a song that is not there.
        """
        if self.audio is not None and self.film is None:
            raise OutputError(
                "--audio", found="no film", expected="a film to be heard in", option="film", suggestion="out.mp4"
            )
        if self.audio is not None and not self.audio.is_file():
            raise OutputError(f"--audio {self.audio}", found="no such file", expected="a song")
        if self.film is not None and self.film.suffix != ".mp4":
            raise OutputError(f"--film {self.film}", found="that name", expected="a file that ends in .mp4")


def film_of(show: PoseStream, options: FilmOptions, what: Path) -> int:
    """Write a film; the number of poses in it.

    Args:
        show: the poses.
        options: with the film's name.
        what: is danced; beside it the song is looked for.
    """
    from retarget.recordings import write_film

    sound, duration_s = _sound(show, options, what.parent), show.frames / show.fps
    if sound.song is not None and sound.at_s >= duration_s:
        raise OutputError(
            "--audio-at", found=f"{sound.at_s:g} s", expected=f"a second of the film, which takes {duration_s:.1f}"
        )
    with progress("frames") as follow:
        return write_film(
            options.film or Path(), show.robot, _shots(show, options), show.fps, (options.width, options.height),
            title=f"{what.stem} on {show.robot.name}{', its reference on the left' if options.beside else ''}", sound=sound,
            beside=_APART if options.beside else 0.0, frames=show.frames, progress=follow,
        )  # fmt: skip


def _shots(show: PoseStream, options: FilmOptions) -> Iterator[Shot]:
    from retarget.recordings import Shot

    for qpos, meant in show.poses:
        if meant is None or not options.beside:
            yield Shot(qpos=qpos, ghost=meant if options.ghost else None)
            continue
        aside = meant.copy()
        aside[1] += _APART
        yield Shot(qpos=qpos, beside=aside)


def _sound(show: PoseStream, options: FilmOptions, folder: Path) -> Soundtrack:
    """What is heard: what was asked for, else what the reference was made for."""
    from retarget.recordings import Soundtrack

    sound = Soundtrack(at_s=show.begins_s) if show.music is None else Soundtrack.of(show.music, folder)
    at_s = sound.at_s if options.audio_at is None else options.audio_at
    return replace(sound, song=options.audio or sound.song, at_s=at_s)


def lost_song(show: PoseStream, options: FilmOptions, what: Path) -> tuple[str, ...]:
    """What is said where the song that the reference was made for is not found."""
    silent = show.music is not None and show.music.song and _sound(show, options, what.parent).song is None
    return (
        (f"without a song: {show.music.song} is not there any more; --audio says where it is",)
        if silent and show.music
        else ()
    )
