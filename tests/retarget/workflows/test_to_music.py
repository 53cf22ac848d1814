"""A dance on a robot and on the beat: the reference knows its song, tells its error, and loses no gate by it."""

import json

import numpy as np
import pytest
from conftest import SAMPLES

from clips import MetricKey, cut, load_reference, read_clip, save_reference
from clips.music import music_of, steady_beats
from retarget import RetargetConfig, retarget, retarget_to_music


@pytest.fixture(scope="module")
def danced():
    clip, beats = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 6.0), steady_beats(108.0, 0.3, 30.0)
    return retarget_to_music(clip, "dancer", beats), beats, retarget(clip, "dancer")


def test_it_lands_on_the_beats_and_holds_every_gate(danced):
    result, _, plain = danced
    report = result.report
    assert report.passed and plain.report.passed
    assert report[MetricKey.BEAT_ERROR].value < 30.0 < report[MetricKey.BEAT_ERROR_RECORDED].value
    assert report[MetricKey.ON_BEAT].value > report[MetricKey.ON_BEAT_RECORDED].value + 20.0
    # As many touches as before: the pace changes, not the dance.
    count = [(np.diff(r.reference.contact[r.reference.dance], axis=0) != 0).sum() for r in (result, plain)]
    assert abs(int(count[0]) - int(count[1])) <= 2


def test_the_file_knows_the_song(danced, tmp_path):
    result, beats, _ = danced
    save_reference(result.reference, tmp_path / "a.npz")
    music = music_of(load_reference(tmp_path / "a.npz"))
    assert np.allclose(np.diff(music.beats_s), 60.0 / 108.0, atol=1e-3)
    # One clock: a beat of the song is a beat of the reference.
    off = (music.beats_s[:, None] - (beats.times_s + music.song_at_s)).reshape(-1)
    assert np.abs(off).min() < 1e-3
    assert music_of(load_reference(tmp_path / "a.npz")).song == ""


def test_a_reference_without_a_song_has_none(danced):
    assert music_of(danced[2].reference) is None


def test_beats_are_seen_in_recording_and_page(danced):
    from retarget.stage import show_reference

    result = danced[0]
    lanes = {lane.name: lane for lane in show_reference(result.robot, result.reference).lanes}
    music = music_of(result.reference)
    assert [a for a, _, _ in lanes["beats"].stretches] == np.round(50.0 * music.beats_s).astype(int).tolist()
    curves = result.report.series
    assert curves["beats of the song"].sum() == len(music.beats_s)
    assert len(curves["accents of the dance"]) == result.reference.frames


@pytest.mark.parametrize("seconds", [0.3, 0.8])
def test_a_dance_that_is_too_short_for_a_beat_has_no_error_and_a_file_all_the_same(seconds, tmp_path):
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, seconds)
    result = retarget_to_music(
        clip, "dancer", steady_beats(40.0, 0.4, 30.0), RetargetConfig(lead_in_s=0.0, lead_out_s=0.0)
    )
    assert MetricKey.BEAT_ERROR not in {m.key for m in result.report.metrics}
    save_reference(result.reference, tmp_path / "a.npz")
    told = load_reference(tmp_path / "a.npz").meta
    json.loads(json.dumps(told), parse_constant=lambda text: pytest.fail(f"{text} is no JSON"))
