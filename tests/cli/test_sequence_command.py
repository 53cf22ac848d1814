"""Several dances in one reference: each is told, drawn and judged."""

import numpy as np
import pytest
from conftest import SAMPLES

import cli.retarget
from clips import MetricKey, cut, read_clip
from retarget.recordings import scene
from retarget.report import Metric
from retarget.workflows import retarget_sequence


@pytest.fixture(scope="module")
def two():
    from robot_models import load_robot

    clips = [cut(read_clip(SAMPLES / name), 0.0, 1.5) for name in ("groove.bvh", "groove.csv")]
    return retarget_sequence(clips, load_robot("dancer"))[0]


def test_every_dance_has_its_own_person_at_its_own_time(two, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(scene, "draw_source", lambda log, source, start: drawn.append((source, start)))

    two.save(tmp_path / "two.rrd")
    assert [start for _, start in drawn] == [d.start for d in two.reference.dances]
    assert [s.frames for s, _ in drawn] == [d.stop - d.start for d in two.reference.dances]
    for source, start in drawn:  # the person stands where the robot dances, and not where another did
        hips = source.point("pelvis")[0, :2]
        assert np.linalg.norm(hips - two.reference.body_pos_w[start, 0, :2]) < 0.2
    text = scene.report_text(two.report, two.diagnoses, two.sources)
    assert "groove.bvh" in text and "groove.csv" in text


def test_the_command_tells_the_conventions_of_every_clip(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = [str(SAMPLES / "groove.bvh"), "--end", "1.5", "--then", str(SAMPLES / "groove.csv"), "--no-recording"]
    assert cli.retarget.main(words) in (0, 1)
    said = capsys.readouterr().out
    assert "groove.bvh: BVH" in said and "groove.csv: CSV" in said and said.count("up axis") == 2
    assert [p.name for p in tmp_path.iterdir()] == ["groove_dancer.npz"]


MORE_IS_BETTER = (
    MetricKey.CONTACT_SHARE, MetricKey.HAND_IN_REACH, MetricKey.ON_BEAT, MetricKey.ON_BEAT_RECORDED
)  # fmt: skip


@pytest.mark.parametrize("key", list(MetricKey))
def test_the_worse_of_two_values_is_the_smaller_where_more_is_better(key):
    low, high = (Metric(key=key, value=v, unit="", meaning="") for v in (1.0, 2.0))
    assert low.worse_than(high) == (key in MORE_IS_BETTER) != high.worse_than(low)
