"""A reference that a robot has danced: of the same shape, and possible."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnxruntime")
pytest.importorskip("pinocchio")

from clips import MetricKey, load_reference, save_reference
from tracking import TrackingError, load_bundle
from tracking.evaluation import danced_reference


def test_what_was_danced_is_the_same_dance_and_physics_allows_it(tmp_path):
    danced, asked = danced_reference(Path("groove-dancer")), load_bundle("groove-dancer").reference
    ours = danced.reference
    np.testing.assert_array_equal(ours.segments, asked.segments)
    assert ours.frames == asked.frames and ours.meta["segment_names"] == asked.meta["segment_names"]
    assert np.abs(ours.joint_pos - asked.joint_pos).mean() < 0.1
    assert not np.array_equal(ours.joint_pos, asked.joint_pos)
    assert danced.report[MetricKey.IMPOSSIBLE_FRAMES].value < 0.5
    save_reference(ours, tmp_path / "danced.npz")
    assert load_reference(tmp_path / "danced.npz").meta["danced"]


def test_a_policy_that_falls_leaves_no_reference(monkeypatch):
    from tracking.policy import Runner

    monkeypatch.setattr(Runner, "act", lambda self, *_: np.full(len(self.contract.joint_names), 0.6))
    with pytest.raises(TrackingError, match="a fall after"):
        danced_reference(Path("groove-dancer"))
