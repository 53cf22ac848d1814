"""Where episodes begin: the shares told, and practice before the frames where robots fell."""

import numpy as np
import pytest

from tracking.config import StartConfig
from tracking.starts import Starts

DT, FRAMES, OPENING = 0.02, 501, 40


def draws(config, fell=(), count=20_000):
    starts = Starts(FRAMES, OPENING, DT, config)
    starts.fell(np.array(fell, dtype=int))
    return starts.draw(count, np.random.default_rng(0))


def test_before_the_first_failure_all_but_the_opening_begins_anywhere():
    drawn = draws(StartConfig(opening=0.2, failed=0.5))
    assert np.mean(drawn == OPENING) == pytest.approx(0.2, abs=0.02)
    assert drawn.min() == 0 and drawn.max() == FRAMES - 1 - 25 - 1
    assert np.mean(drawn < 238) == pytest.approx(0.2 + 0.8 * 0.5, abs=0.02)


def test_practice_begins_within_the_second_before_a_failure():
    drawn = draws(StartConfig(opening=0.0, failed=1.0), fell=[300] * 3)
    assert 250 <= drawn.min() <= 252 and 299 <= drawn.max() <= 300
    assert np.std(np.bincount(drawn - 250)[1:50]) < 60  # evenly over it


def test_frames_that_fell_more_often_are_practised_more_often():
    drawn = draws(StartConfig(opening=0.0, failed=1.0), fell=[100, 300, 300, 300])
    assert np.mean(drawn > 200) == pytest.approx(0.75, abs=0.02)


def test_old_failures_are_forgotten():
    starts = Starts(FRAMES, OPENING, DT, StartConfig(opening=0.0, failed=1.0, remembered=10))
    starts.fell(np.full(10, 100))
    starts.fell(np.full(10, 400))
    assert starts.draw(100, np.random.default_rng(0)).min() >= 350


def test_practice_never_begins_before_the_clip_or_in_its_last_half_second():
    drawn = draws(StartConfig(opening=0.0, failed=1.0), fell=[3, FRAMES - 1])
    assert drawn.min() == 0 and drawn.max() == FRAMES - 1 - 25 - 1
