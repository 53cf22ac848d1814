"""Beats that are stated, read, or refused."""

import numpy as np
import pytest

from clips import ClipError
from clips.music import Beats, read_beats, steady_beats


def test_a_tempo_and_a_first_beat_are_beats():
    beats = steady_beats(120.0, 0.25, 3.0)
    assert np.allclose(beats.times_s, [0.25, 0.75, 1.25, 1.75, 2.25, 2.75]) and beats.bpm == pytest.approx(120.0)


@pytest.mark.parametrize("bpm", [0.0, -3.0, 29.0, 301.0, float("nan"), float("inf")])
def test_no_song_has_such_a_tempo(bpm):
    with pytest.raises(ClipError, match="30 to 300"):
        steady_beats(bpm, 0.0, 10.0)


@pytest.mark.parametrize(
    "text",
    ["0.5\n1.0\n1.5\n",
     "time,bar\n0.5,1\n1.0,1\n1.5,1\n", "0.5\t0.5\tone\n1.0\t1.0\ttwo\n1.5\t1.5\n", "# beats\n\n0.5;1\n1;2\n1.5;3\n"],
    ids=["plain", "csv", "audacity", "semicolons"],
)  # fmt: skip
def test_tables_of_trackers_and_editors_are_read(tmp_path, text):
    (tmp_path / "beats.txt").write_text(text)
    assert read_beats(tmp_path / "beats.txt").times_s.tolist() == [0.5, 1.0, 1.5]


@pytest.mark.parametrize(
    ("text", "told"),
    [("", "0 beats"), ("0.5\n", "1 beats"), ("0.5\nx\n", "beat 2"), ("1.0\n0.5\n", "out of order"), ("0.5\nnan\n", "out of order"),
     ("0\n10\n20\n", "6 beats a minute"), ("0\n0.01\n0.02\n", "6000 beats")],
)  # fmt: skip
def test_other_tables_are_refused(tmp_path, text, told):
    (tmp_path / "beats.csv").write_text(text)
    with pytest.raises(ClipError, match=told):
        read_beats(tmp_path / "beats.csv")


def test_a_table_that_is_not_there_or_no_text(tmp_path):
    with pytest.raises(ClipError, match="No such file"):
        read_beats(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00\x81\x8d")
    with pytest.raises(ClipError, match="text file of beats"):
        read_beats(tmp_path / "b.csv")


def test_beats_out_of_order_are_none():
    with pytest.raises(ClipError, match="out of order"):
        Beats(times_s=np.array([0.0, 1.0, 1.0]), source="mine")


@pytest.mark.parametrize("first_s", [-0.1, -2.0, -100.25])
def test_a_first_beat_before_the_song_stands_for_the_first_in_it(first_s):
    times = steady_beats(104.0, first_s, 20.0).times_s
    assert 0.0 <= times[0] < 60.0 / 104.0
    assert np.isclose(
        np.sin(np.pi * (times[0] - first_s) * 104.0 / 60.0), 0.0, atol=1e-6
    )  # a whole number of beats later


@pytest.mark.parametrize("first_s", [200.0, float("nan"), float("inf"), -1e9])
def test_a_first_beat_after_the_song_is_refused(first_s):
    with pytest.raises(ClipError, match="a second of the song"):
        steady_beats(104.0, first_s, 20.0)


@pytest.mark.parametrize("text", ["1,0.6\n2,1.2\n3,1.8\n", "0;0,60\n1;1,20\n2;1,80\n"])
def test_beats_that_are_counted_are_not_seconds(tmp_path, text):
    (tmp_path / "beats.csv").write_text(text)
    with pytest.raises(ClipError, match="counted"):
        read_beats(tmp_path / "beats.csv")


def test_a_tempo_is_told_over_two_bars():
    times = np.round(np.arange(0.6, 30.0, 60.0 / 104.0) / 0.0232) * 0.0232  # in steps of a tracker's window
    assert Beats(times_s=times, source="x").bpm == pytest.approx(104.0, abs=0.6)
