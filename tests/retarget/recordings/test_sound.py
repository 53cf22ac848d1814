"""A song under a film: heard from its second on, as long as the film, and nothing is left where it cannot be read."""

import subprocess

import numpy as np
import pytest
from scipy.io import wavfile

from clips import OutputError
from retarget.recordings.sound import add_sound

imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
RATE = 16000


@pytest.fixture
def film(tmp_path):
    """Two seconds of grey."""
    path = tmp_path / "film.mp4"
    writer = imageio_ffmpeg.write_frames(str(path), (64, 48), fps=25.0, codec="libx264", macro_block_size=2)
    writer.send(None)
    for k in range(50):
        writer.send(np.full((48, 64, 3), 2 * k, dtype=np.uint8))
    writer.close()
    return path


def song(path, seconds):
    """A tone that begins at once and rises by an octave after half a second."""
    t = np.arange(int(seconds * RATE)) / RATE
    tone = np.sin(2 * np.pi * np.where(t < 0.5, 440.0, 880.0) * t)
    wavfile.write(path, RATE, (20000 * tone).astype(np.int16))
    return path


def heard(path):
    """The sound of a film, as numbers at RATE."""
    words = [
        imageio_ffmpeg.get_ffmpeg_exe(),
        "-v",
        "error",
        "-i",
        str(path),
        "-map",
        "0:a",
        "-ac",
        "1",
        "-ar",
        str(RATE),
    ]
    done = subprocess.run([*words, "-f", "s16le", "-"], capture_output=True, check=True)
    return np.frombuffer(done.stdout, dtype=np.int16).astype(float)


def pitch(sound, begin, end):
    part = sound[int(begin * RATE) : int(end * RATE)]
    return np.fft.rfftfreq(len(part), 1.0 / RATE)[np.abs(np.fft.rfft(part)).argmax()]


@pytest.mark.parametrize("at_s", [0.0, 0.6, -0.5])
def test_the_song_begins_where_it_shall_and_ends_with_the_film(film, tmp_path, at_s):
    before = imageio_ffmpeg.count_frames_and_secs(str(film))
    add_sound(film, song(tmp_path / "song.wav", 1.2), at_s)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(film))
    assert frames == before[0] and seconds == pytest.approx(2.0, abs=0.1)
    sound = heard(film)
    loud = np.flatnonzero(np.abs(sound) > 2000)
    assert loud[0] / RATE == pytest.approx(max(0.0, at_s), abs=0.03)
    assert loud[-1] / RATE == pytest.approx(1.2 + at_s, abs=0.05)  # silence to the film's end
    assert pitch(sound, max(0.0, 0.6 + at_s), 1.0 + at_s) == pytest.approx(880.0, abs=10.0)
    if at_s >= 0.0:
        assert pitch(sound, at_s + 0.1, at_s + 0.4) == pytest.approx(440.0, abs=10.0)


def test_what_is_no_song_is_refused_and_the_film_stays(film, tmp_path):
    (tmp_path / "song.mp3").write_text("la la la")
    before = film.read_bytes()
    with pytest.raises(OutputError, match=r"song\.mp3: found no song"):
        add_sound(film, tmp_path / "song.mp3", 0.0)
    assert film.read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["film.mp4", "song.mp3"]
