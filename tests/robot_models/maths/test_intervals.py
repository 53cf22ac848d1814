import numpy as np
import pytest

from robot_models.maths.intervals import away_from, intervals_of, nearest

MASKS = [[1], [0, 1], [1, 0, 0, 0, 1], [0, 0, 1, 0, 0, 1, 1, 0, 0, 0], [1, 1, 1]]


@pytest.mark.parametrize("bits", MASKS)
def test_the_nearest_true_frame_is_the_one_that_a_search_of_all_finds(bits: list[int]) -> None:
    mask = np.array(bits, dtype=bool)
    true = np.flatnonzero(mask)
    distances = np.abs(np.arange(len(mask))[:, None] - true[None])
    np.testing.assert_array_equal(nearest(mask), true[distances.argmin(axis=1)])
    np.testing.assert_array_equal(away_from(mask), distances.min(axis=1))


@pytest.mark.parametrize("bits", MASKS)
def test_runs_cover_the_true_frames_and_no_other(bits: list[int]) -> None:
    mask, covered = np.array(bits, dtype=bool), np.zeros(len(bits), dtype=bool)
    for start, end in intervals_of(mask):
        assert not covered[start:end].any()
        covered[start:end] = True
    np.testing.assert_array_equal(covered, mask)
