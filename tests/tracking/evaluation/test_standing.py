"""Many references judged at once: who stands two seconds, and how long from the beginning."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from clips import load_reference
from tracking import TaskConfig
from tracking.config import RandomisationConfig, StartNoise, TerminationConfig
from tracking.evaluation import judge_standing
from tracking.task import NamedReference


@pytest.fixture(scope="module")
def references(dancer, groove_file):
    one = NamedReference(name="one", reference=load_reference(groove_file, dancer), path=Path(groove_file), sha256="")
    return [one, dataclasses.replace(one, name="two")]


def zero(task):
    return np.zeros((task.envs, task.actions))


def quiet(**rules):
    return dataclasses.replace(
        TaskConfig(), start_noise=StartNoise(scale=0.0), randomisation=RandomisationConfig(enabled=False),
        terminations=TerminationConfig(**rules),
    )  # fmt: skip


def test_who_cannot_fail_stands_to_the_end_of_what_there_is(dancer, references):
    endless = quiet(anchor_height=1e3, anchor_tilt=1e3, end_effector_height=1e3)
    for found in judge_standing(zero, dancer, references, endless, starts=3, openings=2, longest_s=2.5):
        assert (found.stand, found.seconds) == (1.0, pytest.approx(2.5))
    whole = judge_standing(zero, dancer, references, endless, starts=1, openings=1, longest_s=60.0)[0]
    dance = references[0].reference.dance
    assert (
        whole.seconds == whole.possible_s == pytest.approx((dance.stop - 1 - dance.start) / 50.0)
    )  # no lead-out in it


def test_who_fails_at_once_stands_nowhere(dancer, references):
    strict = quiet(anchor_height=0.0)
    for found in judge_standing(zero, dancer, references, strict, starts=3, openings=2, longest_s=1.0):
        assert (found.stand, found.seconds) == (0.0, 0.0)
