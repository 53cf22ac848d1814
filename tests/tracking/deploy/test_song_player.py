"""A song that begins with the dance: at its second, to a few milliseconds, and silent otherwise."""

import sys
import time

import numpy as np
import pytest
from scipy.io import wavfile

from tracking import TrackingError
from tracking.deploy import SongPlayer

pytest.importorskip("soundfile")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="waits on a pipe")
RATE = 8000


@pytest.fixture
def song(tmp_path):
    """Half a second of silence, then two of noise."""
    sound = np.concatenate((np.zeros(RATE // 2), np.random.default_rng(0).uniform(-1, 1, 2 * RATE)))
    wavfile.write(tmp_path / "song.wav", RATE, (20000 * sound).astype(np.int16))
    return tmp_path / "song.wav"


def heard(sink):
    """When which loudness was given to the loudspeaker."""
    return np.loadtxt(sink, ndmin=2) if sink.exists() else np.zeros((0, 2))


@pytest.mark.parametrize(("at_s", "late_s"), [(0.0, 0.0), (0.3, 0.0), (-0.4, 0.0), (0.3, 0.1)])
def test_the_noise_is_heard_in_its_second(song, tmp_path, at_s, late_s):
    with SongPlayer(song, at_s, late_s, sink=tmp_path / "sink.txt") as player:
        assert player.late_s == late_s
        time.sleep(0.3)
        assert not len(heard(tmp_path / "sink.txt"))  # nothing before the word
        player.begin()
        began = time.monotonic()
        time.sleep(1.6)
    times, loud = heard(tmp_path / "sink.txt").T
    # A loudspeaker that is late is given the song that much earlier.
    assert times[loud > 0.05][0] - began == pytest.approx(0.5 + at_s - late_s, abs=0.15)


def test_it_ends_with_the_dance_and_begins_anew_with_the_next(song, tmp_path):
    with SongPlayer(song, 0.0, 0.0, sink=tmp_path / "sink.txt") as player:
        player.begin()
        time.sleep(0.9)
        player.end()
        time.sleep(0.3)
        count = len(heard(tmp_path / "sink.txt"))
        time.sleep(0.3)
        assert len(heard(tmp_path / "sink.txt")) == count
        player.begin()
        time.sleep(0.5)
    assert len(heard(tmp_path / "sink.txt")) > count


def test_a_word_costs_the_control_loop_nothing(song, tmp_path):
    with SongPlayer(song, 0.0, 0.0, sink=tmp_path / "sink.txt") as player:
        took = []
        for _ in range(20):
            began = time.perf_counter()
            player.begin()
            took.append(time.perf_counter() - began)
        player._process.kill()
        player._process.wait()
        player.begin()  # whatever became of it
    assert np.median(took) < 0.002


def test_what_is_no_song_is_refused_before_anything_moves(tmp_path):
    (tmp_path / "song.wav").write_bytes(b"nothing")
    with pytest.raises(TrackingError, match="a song and a sound device"):
        SongPlayer(tmp_path / "song.wav", 0.0)
