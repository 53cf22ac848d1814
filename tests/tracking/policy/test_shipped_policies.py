"""The policies that come with the package fit the robots as they are now, and dance."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from tracking import TaskConfig, TrackingError, evaluate, evaluation_task, load_bundle


@pytest.mark.parametrize("name", ["groove-dancer", pytest.param("groove-g1", marks=pytest.mark.slow)])
def test_a_shipped_policy_finishes_its_dance(name):
    bundle = load_bundle(Path(name))
    task = evaluation_task(TaskConfig())
    result = evaluate(bundle.runner, bundle.robot, bundle.reference, task, rollouts=10, seed=3)
    assert result.finished >= 0.7 and result.body_error_mm < 60.0

    def nothing(seen):
        return np.zeros((len(seen), len(bundle.robot.joint_names)))

    still = evaluate(nothing, bundle.robot, bundle.reference, task, rollouts=10, seed=3)
    assert still.finished <= 0.1  # the policy does it, not the prior


def test_what_is_no_bundle_is_refused_with_the_names_of_those_there_are(tmp_path):
    with pytest.raises(TrackingError, match="groove-dancer, groove-g1"):
        load_bundle(tmp_path / "nothing")
