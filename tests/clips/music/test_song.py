"""Beats found in songs whose beats are known, and what is no song."""

import numpy as np
import pytest

from clips import ClipError
from clips.music import find_beats, loudness
from clips.samples import beats_of, write_song

pytest.importorskip("librosa")


@pytest.mark.slow  # librosa compiles itself for half a minute
@pytest.mark.parametrize(
    "tempi", [[(104, 8), (112, 10)], [(90, 12)], [(128, 16)], [(100, 4), (106, 4), (112, 4), (118, 4)]]
)
def test_beats_are_found_to_a_frame_of_film(tmp_path, tempi):
    beats = beats_of(*tempi)
    told = []
    found = find_beats(write_song(tmp_path / "song.wav", beats), progress=lambda *what: told.append(what[1]))
    off = np.abs(beats[:, None] - found.times_s).min(axis=1)
    assert np.median(off) < 0.02 and (off < 0.04).mean() > 0.97  # every beat
    inside = found.times_s[(found.times_s > beats[0] - 0.1) & (found.times_s < beats[-1] + 0.1)]
    assert len(inside) <= len(beats) + 1  # and nothing else
    assert told == sorted(told)


@pytest.mark.slow
def test_a_stated_tempo_settles_which_octave(tmp_path):
    beats = beats_of((75, 12))
    found = find_beats(write_song(tmp_path / "song.wav", beats), bpm=75.0)
    assert found.bpm == pytest.approx(75.0, rel=0.02)


@pytest.mark.parametrize("content", [b"", b"RIFF", b"x" * 4000])
def test_what_is_no_song_is_refused(tmp_path, content):
    (tmp_path / "song.wav").write_bytes(content)
    with pytest.raises(ClipError, match="no song that can be read"):
        find_beats(tmp_path / "song.wav")
    assert loudness(tmp_path / "song.wav", np.arange(10) / 50.0) is None


def test_a_sound_of_a_second_has_no_beats_to_be_found(tmp_path):
    with pytest.raises(ClipError, match="at least 5 s"):
        find_beats(write_song(tmp_path / "song.wav", np.array([0.1, 0.3])))


def test_it_is_loudest_on_the_drum(tmp_path):
    beats = np.array([0.5, 1.5, 2.5, 3.5, 4.5])
    times = np.arange(-50, 300) / 50.0
    heard = loudness(write_song(tmp_path / "song.wav", beats), times)
    assert heard.max() == 1.0 and heard[times < 0.0].max() == 0.0
    for beat in beats[:-1]:
        assert heard[np.abs(times - beat - 0.02).argmin()] > 3.0 * heard[np.abs(times - beat + 0.06).argmin()]
