"""Beats found in a song, by librosa (dynamic programming over onsets: Ellis 2007, "Beat Tracking by Dynamic Programming")."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.errors import ClipError
from clips.music.beats import Beats, check_tempo
from robot_models import import_or_refuse
from robot_models.maths import Progress, silent

_RATE = 22_050  # samples a second, which librosa's beat tracker is tuned for
_HOP = 512
_FINE_HOP, _FINE_WINDOW, _REACH_S = 64, 512, 0.07  # of the onsets near a beat that it is moved to
_TEMPO_EDGE_S = 4.0
_LEAST_S = 5.0


def find_beats(song: Path, bpm: float | None = None, *, progress: Progress = silent) -> Beats:
    """The beats of a song.

    Args:
        song: a WAV, FLAC, OGG or MP3.
        bpm: its tempo, where it is known.
        progress: told before what takes time: librosa compiles itself when it is used first, a minute on a slow machine.

    Raises:
        ClipError: no librosa, no song that can be read, or no beats in it.
    """
    refusal = ClipError(
        str(song), found="no package librosa", expected="it installed, to find beats",
        cure="pip install 'dance-retarget[music]', or state tempo and first beat",
    )  # fmt: skip
    librosa = import_or_refuse("librosa", refusal)
    if bpm is not None:
        check_tempo(bpm)
    progress("beats", 0, 3, "read the song")
    samples = _read(song)
    progress("beats", 1, 3, "find its beats")
    onsets = librosa.onset.onset_strength(y=samples, sr=_RATE, hop_length=_HOP, aggregate=np.median)
    tempo = bpm or _tempi(librosa, onsets)
    _, times = librosa.beat.beat_track(
        onset_envelope=onsets, sr=_RATE, hop_length=_HOP, units="time", trim=False, bpm=tempo
    )
    progress("beats", 2, 3, "set them on its onsets")
    fine = librosa.onset.onset_strength(y=samples, sr=_RATE, hop_length=_FINE_HOP, n_fft=_FINE_WINDOW, n_mels=64)
    times = _on_onsets(np.asarray(times), np.asarray(fine), _FINE_HOP / _RATE)
    progress("beats", 3, 3, "")
    if len(times) < 2:
        raise ClipError(str(song), found="no beats", expected="music with a beat", cure="state tempo and first beat")
    return Beats(times_s=times, source="found in it", song=song)


def _tempi(librosa: Any, onsets: Float[ndarray, "F"]) -> Float[ndarray, "F"]:
    """A tempo for every moment: with one for all of it, a song that changes its own loses a third of its beats."""
    tempi = np.asarray(librosa.feature.tempo(onset_envelope=onsets, sr=_RATE, hop_length=_HOP, aggregate=None))
    # At both ends half of the window lies outside of the song.
    edge = min(int(_TEMPO_EDGE_S * _RATE / _HOP), (len(tempi) - 1) // 2)
    tempi[:edge], tempi[len(tempi) - edge :] = tempi[edge], tempi[-edge - 1]
    return tempi


def duration_of(song: Path) -> float | None:
    """How long a song is [s]; None where nothing that reads it is installed.

    Raises:
        ClipError: it cannot be read.
    """
    try:
        import soundfile
    except ImportError:
        return None
    try:
        return float(soundfile.info(song).duration)
    except (OSError, RuntimeError) as e:
        raise _no_song(song, e) from e


def loudness(song: Path, times_s: Float[ndarray, "T"]) -> Float[ndarray, "T"] | None:
    """How loud a song is at some times of it, 1 at its loudest; None where it cannot be read, or nothing that reads it is there.

    Args:
        song: its file.
        times_s: evenly spaced; 0 before it begins and after it ends [s].
    """
    try:
        samples, rate = _samples(song)
    except (ClipError, ImportError):
        return None
    half = max(1, round(0.5 * rate * float(np.median(np.diff(times_s)))))
    squares = np.concatenate(([0.0], np.cumsum(np.asarray(samples, dtype=float) ** 2)))
    middle = np.round(times_s * rate).astype(int)
    low, high = ((middle + side).clip(0, len(samples)) for side in (-half, half))
    heard = np.sqrt((squares[high] - squares[low]) / (2.0 * half))
    return np.asarray(heard / max(1e-9, heard.max()))


def _read(song: Path) -> Float[ndarray, "S"]:
    """Its samples at the rate that is worked with."""
    import librosa

    samples, rate = _samples(song)
    if len(samples) < _LEAST_S * rate:
        raise ClipError(str(song), found=f"{len(samples) / rate:.1f} s of sound", expected=f"at least {_LEAST_S:.0f} s")
    return np.asarray(librosa.resample(samples, orig_sr=rate, target_sr=_RATE))


def _samples(song: Path) -> tuple[Float[ndarray, "S"], int]:
    """All channels as one, and samples a second."""
    import soundfile

    try:
        samples, rate = soundfile.read(song, dtype="float32", always_2d=True)
    except (OSError, RuntimeError) as e:
        raise _no_song(song, e) from e
    return samples.mean(axis=1), int(rate)


def _no_song(song: Path, why: Exception) -> ClipError:
    return ClipError(
        str(song), found=f"no song that can be read ({why})", expected="a WAV, FLAC, OGG or MP3",
        cure="ffmpeg -i song.m4a song.wav",
    )  # fmt: skip


def _on_onsets(times: Float[ndarray, "B"], onsets: Float[ndarray, "F"], step_s: float) -> Float[ndarray, "B"]:
    """Beats moved, all together, by what brings them nearest to the onsets: what a tracker finds is late by its window."""
    reach = round(_REACH_S / step_s)
    places = np.round(times / step_s).astype(int)
    inside = places[(places >= reach) & (places < len(onsets) - reach)]
    if not len(inside):
        return times
    near = np.array([onsets[place - reach : place + reach + 1] for place in inside])
    return times + (int(near.mean(axis=0).argmax()) - reach) * step_s
