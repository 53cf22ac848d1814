"""Recordings: whole, small, with what they promise inside."""

from robot_models import load_robot


def test_a_recording_holds_source_targets_robot_contacts_and_curves(groove, tmp_path):
    import rerun as rr

    path = tmp_path / "g.rrd"
    groove.save(path)
    data = path.read_bytes()
    assert list(tmp_path.iterdir()) == [path]
    for name in (
        b"world/source",
        b"world/targets",
        b"world/robot/left_knee_link",
        b"plots/report/lowest-point-m",
        b"report",
    ):
        assert name in data, name
    minutes = groove.reference.duration_s / 60
    assert len(data) / 1e6 < 1.5 + 8.0 * minutes  # the size that the README promises
    assert rr.__version__.startswith("0.41")


def test_the_ghost_is_the_part_of_the_dance_that_the_rollout_follows(groove, tmp_path, monkeypatch):
    import numpy as np

    import retarget.recordings.stories

    seen = {}
    monkeypatch.setattr(retarget.recordings.scene, "plot_curves", lambda log, root, series, index: seen.update(series))
    rollout = groove.reference.qpos[groove.reference.dance][:50]
    retarget.recordings.stories.save_rollouts(
        tmp_path / "t.rrd", load_robot("dancer"), groove.reference, {"policy": rollout}, {}, "# text"
    )
    assert np.abs(seen["distance from the ghost [mm]"]).max() < 1e-6
