"""Where episodes begin: the shares told, and practice before the frames where robots fell."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracking.config import StartConfig
from tracking.task.resets import ResetSampler

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

DT, FRAMES, OPENING = 0.02, 501, 40
NOWHERE = np.empty(0, dtype=int)


def tables(*lengths):
    """Just what starts are drawn from."""
    ends = np.cumsum(lengths)
    return SimpleNamespace(
        first=np.repeat(ends - lengths, lengths), last=np.repeat(ends - 1, lengths), openings=ends - lengths + OPENING
    )


def draws(config, failed=(), count=20_000):
    starts = ResetSampler(tables(FRAMES), DT, config)
    starts.record(NOWHERE, np.array(failed, dtype=int))
    return starts.draw(count, np.random.default_rng(0))


def test_before_the_first_failure_all_but_the_opening_begins_anywhere():
    drawn = draws(StartConfig(opening=0.2, failed=0.5))
    assert np.mean(drawn == OPENING) == pytest.approx(0.2, abs=0.02)
    assert drawn.min() == 0 and drawn.max() == FRAMES - 1 - 25 - 1
    assert np.mean(drawn < 238) == pytest.approx(0.2 + 0.8 * 0.5, abs=0.02)


def test_practice_begins_within_the_second_before_a_failure():
    drawn = draws(StartConfig(opening=0.0, failed=1.0), failed=[300] * 3)
    assert 250 <= drawn.min() <= 252 and 299 <= drawn.max() <= 300
    assert np.std(np.bincount(drawn - 250)[1:50]) < 60  # evenly over it


def test_frames_that_fell_more_often_are_practised_more_often():
    drawn = draws(StartConfig(opening=0.0, failed=1.0), failed=[100, 300, 300, 300])
    assert np.mean(drawn > 200) == pytest.approx(0.75, abs=0.02)


def test_old_failures_are_forgotten():
    starts = ResetSampler(tables(FRAMES), DT, StartConfig(opening=0.0, failed=1.0, remembered=60))
    starts.record(NOWHERE, np.full(60, 100))
    starts.record(NOWHERE, np.full(60, 400))
    assert starts.draw(100, np.random.default_rng(0)).min() >= 350


def test_practice_never_begins_before_the_clip_or_in_its_last_half_second():
    drawn = draws(StartConfig(opening=0.0, failed=1.0), failed=[3, FRAMES - 1])
    assert drawn.min() == 0 and drawn.max() == FRAMES - 1 - 25 - 1


def test_several_references_share_the_starts_by_length_and_weight_and_the_openings_evenly():
    rng, lengths = np.random.default_rng(0), (326, 126, 326)
    drawn = ResetSampler(tables(*lengths), DT, StartConfig(opening=0.0, failed=0.0), (1.0, 1.0, 0.5)).draw(20_000, rng)
    shares = np.histogram(drawn, bins=(0, 326, 452, 778))[0] / 20_000
    assert shares == pytest.approx(np.array((300, 100, 150)) / 550, abs=0.02)
    for end in np.cumsum(lengths):  # the last half second of each is nobody's
        assert not ((drawn >= end - 26) & (drawn < end)).any()
    opened = ResetSampler(tables(*lengths), DT, StartConfig(opening=1.0, failed=0.0), (1.0, 1.0, 0.5)).draw(3_000, rng)
    assert np.unique(opened, return_counts=True)[1] == pytest.approx(1_000, abs=120)


def test_practice_stays_in_the_reference_that_the_robot_fell_in():
    starts = ResetSampler(tables(300, 300), DT, StartConfig(opening=0.0, failed=1.0), (1.0, 1.0))
    starts.record(NOWHERE, np.array([305]))
    drawn = starts.draw(1000, np.random.default_rng(0))
    assert drawn.min() == 300 and drawn.max() <= 305


def test_a_reference_that_robots_fail_in_more_often_per_step_is_practised_more_within_limits():
    def share_of_first(failed, steps):
        starts = ResetSampler(tables(400, 400), DT, StartConfig(opening=0.0, failed=1.0, favour=(0.3, 3.0)), (1.0, 1.0))
        starts.record(np.repeat((100, 500), steps), np.repeat((100, 500), failed))
        return np.mean(starts.draw(20_000, np.random.default_rng(0)) < 400)

    assert share_of_first((10, 10), (100, 100)) == pytest.approx(0.5, abs=0.02)
    assert share_of_first((20, 10), (200, 100)) == pytest.approx(0.5, abs=0.02)  # no harder, only danced more
    assert share_of_first((20, 10), (100, 100)) == pytest.approx(2 / 3, abs=0.02)
    assert share_of_first((500, 1), (100, 100)) == pytest.approx((500 / 250.5) / (500 / 250.5 + 0.3), abs=0.02)
