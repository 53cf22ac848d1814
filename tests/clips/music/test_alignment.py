"""A dance brought to a song: nearer to its beats than at any one pace, never further from its own than is stated."""

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, read_clip
from clips.edit import resample
from clips.music import (
    Accents,
    Beats,
    MusicConfig,
    beat_error,
    find_accents,
    parts_of,
    steady_beats,
    to_the_beat,
)


@pytest.fixture(scope="module")
def dance():
    """The sample dance, 120 beats a minute."""
    clip = resample(read_clip(SAMPLES / "groove.bvh"), 50.0)
    return clip, find_accents(parts_of(clip), clip.fps)


def error_of(clip, beats, begins_s):
    return beat_error(find_accents(parts_of(clip), clip.fps), beats.times_s - begins_s, (clip.frames - 1) / clip.fps)


@pytest.mark.parametrize("bpm", [104.0, 110.0, 116.0, 126.0])
def test_accents_land_on_the_beats_of_another_tempo(dance, bpm):
    clip, accents = dance
    beats = steady_beats(bpm, 0.4, 60.0)
    plain, at = to_the_beat(clip, accents, beats, MusicConfig(stretch=0.0))
    paced, where = to_the_beat(clip, accents, beats)
    before, after = error_of(plain, beats, at.begins_s), error_of(paced, beats, where.begins_s)
    assert after.median_ms < 25.0 < before.median_ms  # the control: no one offset does it
    assert after.on_beat > before.on_beat + 0.2


@pytest.mark.parametrize("stretch", [0.0, 0.05, 0.15, 0.3])
def test_the_pace_stays_within_what_is_stated(dance, stretch):
    clip, accents = dance
    paced, where = to_the_beat(clip, accents, steady_beats(100.0, 0.4, 60.0), MusicConfig(stretch=stretch))
    assert np.abs(where.pace - 1.0).max() <= stretch + 1e-9
    assert len(where.pace) == clip.frames
    assert (1.0 - stretch) * clip.frames <= paced.frames + 1 and paced.frames - 1 <= clip.frames / (1.0 - stretch)


def test_without_any_stretch_it_is_the_dance_itself(dance):
    clip, accents = dance
    paced, _ = to_the_beat(clip, accents, steady_beats(97.0, 0.0, 60.0), MusicConfig(stretch=0.0))
    assert paced.frames == clip.frames and np.allclose(paced.positions, clip.positions, atol=1e-9)


def test_a_tempo_that_changes_is_followed(dance):
    clip, accents = dance
    gaps = np.concatenate((np.full(10, 60.0 / 112.0), np.full(30, 60.0 / 128.0)))
    beats = Beats(times_s=0.5 + np.cumsum(gaps), source="made up")
    paced, where = to_the_beat(clip, accents, beats)
    assert error_of(paced, beats, where.begins_s).median_ms < 30.0


def test_it_begins_where_it_is_told(dance):
    clip, accents = dance
    _, where = to_the_beat(clip, accents, steady_beats(110.0, 0.4, 60.0), start_s=7.3)
    assert where.begins_s == pytest.approx(7.3, abs=0.05)


def test_a_song_that_ends_before_the_dance_is_refused(dance):
    clip, accents = dance
    with pytest.raises(ClipError, match=r"beats until 5\."):
        to_the_beat(clip, accents, Beats(times_s=np.arange(0.0, 5.5, 0.5), source="short"))


def test_a_dance_without_accents_keeps_its_pace(dance):
    clip, _ = dance
    _, where = to_the_beat(clip, Accents(times_s=np.zeros(0), strength=np.zeros(0)), steady_beats(110.0, 0.4, 60.0))
    assert np.allclose(where.pace, 1.0, atol=0.01)


@pytest.mark.parametrize("stretch", [-0.1, 0.6, float("nan")])
def test_such_a_stretch_is_refused(stretch):
    with pytest.raises(ClipError, match=r"0 to 0\.5"):
        MusicConfig(stretch=stretch)


def test_the_beat_error_is_by_hand():
    accents = Accents(times_s=np.array([0.98, 2.05, 2.9]), strength=np.ones(3))
    error = beat_error(accents, np.array([-1.0, 1.0, 2.0, 3.0, 9.0]), 4.0)  # two of the beats are not danced to
    assert error.median_ms == pytest.approx(50.0) and error.on_beat == pytest.approx(1 / 3)
    assert error.p95_ms == pytest.approx(95.0)
    resting = Accents(times_s=np.array([0.98, 3.9]), strength=np.ones(2))
    assert beat_error(resting, np.arange(0.0, 8.0), 8.0).p95_ms == pytest.approx(
        1000.0, abs=110.0
    )  # 5, 6, 7 do not count
    nothing = Accents(times_s=np.zeros(0), strength=np.zeros(0))
    assert beat_error(nothing, np.arange(4.0), 4.0) is None and beat_error(accents, np.array([1.0]), 4.0) is None
