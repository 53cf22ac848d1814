"""Results as a library's user meets them: short to print, whole to keep, drawn on request."""

import dataclasses

import pytest

from clips import OutputError, load_reference, read_clip
from retarget import Gates, RetargetConfig


def test_everything_that_a_session_prints_is_short(groove, dancer):
    pytest.importorskip("onnxruntime")
    from tracking import load_bundle

    bundle = load_bundle("groove-dancer")
    for thing in (groove, groove.reference, groove.report, groove.source, dancer, bundle.reference, bundle.robot):
        assert len(repr(thing)) < 200, repr(thing)[:300]
    assert "every gate holds" in repr(groove) and "groove" in repr(groove)


def test_a_result_is_kept_by_the_name_it_is_given(groove, tmp_path):
    assert load_reference(groove.save(tmp_path / "g.npz"), groove.robot).frames == groove.reference.frames
    assert groove.save(str(tmp_path / "g.rrd")).stat().st_size > 100_000
    with pytest.raises(OutputError, match="npz, .rrd, .png or .mp4"):
        groove.save(tmp_path / "g.txt")
    assert read_clip(tmp_path / "g.npz").robot == groove.robot.name


def test_a_notebook_shows_every_number_and_names_what_is_missed(groove):
    html = groove._repr_html_()
    assert html.count("<tr") == len(groove.report.metrics) + 1 and "color:red" not in html
    missed = dataclasses.replace(
        groove.report,
        metrics=tuple(dataclasses.replace(m, limit=None if m.limit is None else -1.0) for m in groove.report.metrics),
    )
    assert missed._repr_html_().count("color:red") == len(missed.failures) > 5


def test_the_plot_has_a_panel_for_each_curve_and_shades_what_is_missed(groove, dancer):
    pytest.importorskip("matplotlib")
    figure = groove.plot()
    assert [panel.get_title(loc="left") for panel in figure.axes] == list(groove.report.series)
    assert not any(panel.patches for panel in figure.axes)
    from clips import cut
    from retarget import retarget

    clip = cut(groove.source, 0.0, 2.0)
    missed = retarget(clip, dancer, RetargetConfig(gates=Gates(slide_mm=0.0)))
    assert all(panel.patches for panel in missed.plot().axes)


def test_showing_opens_a_viewer_on_a_whole_recording(groove, monkeypatch):
    from pathlib import Path

    from retarget.recordings import viewer

    with monkeypatch.context() as patch:
        patch.setattr(viewer, "has_display", lambda: False)
        with pytest.raises(OutputError, match="no display"):
            groove.show()
    monkeypatch.setattr(viewer, "has_display", lambda: True)
    opened = []
    monkeypatch.setattr(viewer.subprocess, "Popen", lambda words, **_: opened.append(words))
    groove.show()
    ((*_, module, path),) = opened
    assert module == "rerun_cli" and Path(path).stat().st_size > 100_000
    monkeypatch.setattr(viewer.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(OutputError, match="no Rerun viewer"):
        groove.show()


@pytest.mark.parametrize("robot", ["dancer", "g1"])
def test_who_gets_up_from_the_belly_is_carried_by_hands_and_knees(shared, robot):
    from damage import read_shared

    from clips import MetricKey
    from retarget import retarget
    from robot_models import PART_NAMES, load_robot

    result = retarget(read_shared(shared, "deepmimic/humanoid3d_getup_facedown.txt"), load_robot(robot))
    told = {m.key: m.value for m in result.report.metrics}
    assert not result.report.failures and result.reference.meta["segment_names"] == ["dance", "lead-out"]
    assert told[MetricKey.IMPOSSIBLE_FRAMES] < 5.0 and told[MetricKey.LIMB_DIRECTION_ERROR] < 8.0
    assert told[MetricKey.PENETRATION] < 5.0 and told[MetricKey.AIRBORNE] < 5.0
    touches = dict(zip(PART_NAMES, result.reference.part_contact.any(axis=0), strict=True))
    assert all(touches[name] for name in ("pelvis", "left_knee", "right_knee", "left_hand", "right_hand"))
    assert not result.reference.contact[:20].any()  # its feet lie
