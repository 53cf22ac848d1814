"""What a page has to show: lanes that say what the labels say, figures at the reference's poses, one clock for all."""

import re
from dataclasses import replace

import numpy as np
import pytest

from clips import FREE, MetricKey
from retarget import Diagnosis, Metric, RetargetError, Where, dynamics_of
from retarget.stage import Show, show_reference, show_retargeting, show_side_by_side
from retarget.stage.lanes import lanes_svg, playhead, report_table
from retarget.stage.show import OF_CONTACT, RED, Row, contact_lanes


@pytest.fixture(scope="module")
def show(groove):
    return show_retargeting(
        groove.robot, groove.reference, groove.report, groove.diagnoses, groove.sources, groove.dynamics
    )


def test_lanes_say_what_the_labels_say(groove):
    labels = groove.reference.contact
    lanes = contact_lanes(groove.reference)
    assert [lane.name for lane in lanes[:4]] == ["left heel", "left toe", "right heel", "right toe"]
    for lane, kinds in zip(lanes, labels.T, strict=False):
        painted = np.full(len(kinds), FREE)
        for a, b, colour in lane.stretches:
            painted[a:b] = next(kind for kind, c in OF_CONTACT.items() if c == colour)
        np.testing.assert_array_equal(painted, kinds)


def test_a_retargeting_has_its_person_where_the_dance_begins_and_forces_that_carry_it(groove, show):
    (person,), (given, missing) = show.people, show.arrows
    assert person.begins == groove.reference.dance.start
    assert len(person.bones_w) == groove.source.frames
    still = 10  # of the lead-in, on both feet: the arrows together are one weight long
    assert given.along_w[still, :, 2].sum() == pytest.approx(1.2, rel=0.1)
    assert np.abs(missing.along_w[still]).max() == 0.0
    assert show.verdict == "every gate holds" and not show.moments


def test_a_reference_tells_what_its_file_says(groove):
    show = show_reference(groove.robot, groove.reference, dynamics_of(groove.reference, groove.robot))
    assert show.verdict == "every gate holds" and len(show.rows) == len(groove.report.metrics)
    spoiled = {
        k: dict(v, passed=False, at_s=1.5) if k == "penetration" else v for k, v in groove.reference.report.items()
    }
    told = replace(groove.reference, meta={**groove.reference.meta, "report": spoiled})
    assert show_reference(groove.robot, told).moments == ((1.5, "deepest point under the floor"),)
    unknown = replace(groove.reference, meta={})
    assert "nothing was measured" in show_reference(groove.robot, unknown).verdict


def test_a_missed_gate_is_a_red_lane_and_a_moment(groove):
    where = Where(at_s=1.0, stretches=((0.5, 1.5),))
    metric = Metric(key=MetricKey.PENETRATION, value=30.0, unit="mm", meaning="", limit=5.0, where=where)
    found = [Diagnosis(metric=metric, dance=0, what="left foot 30 mm under the floor at 1.00 s")]
    show = show_retargeting(groove.robot, groove.reference, groove.report, found)
    (lane,) = [lane for lane in show.lanes if lane.name == metric.label]
    assert lane.stretches == ((25, 76, RED),)
    assert show.moments == ((1.0, "left foot 30 mm under the floor at 1.00 s"),)


def test_several_share_a_clock_or_are_refused(groove):
    pair = {"a": (groove.robot, groove.reference), "b": (groove.robot, groove.reference)}
    show = show_side_by_side(pair)
    assert [f.place for f in show.figures] == [0, 1] and show.frames == groove.reference.frames
    other = replace(groove.reference, fps=30.0)
    with pytest.raises(RetargetError, match="30 frames/s"):
        show_side_by_side({**pair, "b": (groove.robot, other)})


def test_the_drawn_lanes_end_where_the_stretches_do(show):
    drawn = lanes_svg(show, 500)
    bars = [float(w) for w in re.findall(r'<rect x="[\d.]+" y="[\d.]+" width="([\d.]+)"', drawn)]
    frames = sum(b - a for lane in show.lanes for a, b, _ in lane.stretches)
    assert sum(bars) == pytest.approx(frames * (500 - 118 - 6) / show.frames, rel=0.01)
    at = [float(re.search(r"-8px 0 0 ([\d.]+)%", playhead(show, t, 500)).group(1)) for t in (0, show.frames - 1)]
    assert at == pytest.approx([100 * 118 / 500, 100 * (500 - 6) / 500])


def test_what_files_say_is_text_on_the_page(show):
    """A name in a file is no markup."""
    wild = replace(show, rows=(Row(passed=False, what="<script>", value="1", limit="<b>"),))
    assert isinstance(wild, Show)
    table = report_table(wild)
    assert "<script>" not in table and "&lt;script&gt;" in table and "rgb(230,55,45)" in table
