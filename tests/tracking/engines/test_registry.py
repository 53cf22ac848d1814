"""Engines by name."""

import pytest

from tracking import TrackingError
from tracking.engines.registry import ENGINES, TRAINING, engine_names, training_engine


@pytest.mark.parametrize("name", ENGINES)
def test_an_engine_stands_for_itself(name):
    assert engine_names(name) == (name,)


@pytest.mark.parametrize("group", ["physx", "all"])
def test_a_group_stands_for_engines_each_once(group):
    names = engine_names(group)
    assert len(set(names)) == len(names) > 1 and set(names) <= set(ENGINES)
    assert set(names) == {n for n in ENGINES if group == "all" or n.startswith("physx")}


@pytest.mark.parametrize("name", ["", "bullet", "MuJoCo", "mujoco ", "isaac"])
def test_another_name_is_refused_with_all_that_there_are(name):
    with pytest.raises(TrackingError, match="no such engine") as refused:
        engine_names(name)
    assert all(known in str(refused.value) for known in (*ENGINES, "physx", "all"))


@pytest.mark.parametrize("name", ["physx", "physx-isaac", "all", ""])
def test_what_cannot_be_trained_in_is_refused_with_what_can(name):
    with pytest.raises(TrackingError, match="none to train in.*" + ", ".join(TRAINING)):
        training_engine(name)
    assert [training_engine(n) for n in TRAINING] == list(TRAINING.values())
    assert training_engine("mujoco") is ENGINES["mujoco"]  # evaluated as it was trained
