"""Lost samples: short gaps are filled along the straight line, long ones refused or left out, nothing moves."""

import numpy as np
import pytest

from clips import ClipError
from clips.config import REPAIR
from clips.edit.gaps import without_gaps

NAMES = ("knee", "stray", "hip", "extra")
FPS = 100.0
LONGEST = round(REPAIR.gap_s * FPS)


def marching(frames=100):
    """Every coordinate grows by one a frame: 1000 x point + 100 x axis + frame."""
    return 1000.0 * np.arange(4)[:, None] + 100.0 * np.arange(3) + np.arange(frames)[:, None, None]


def whole(positions, fps=FPS):
    return without_gaps(positions, NAMES, ("knee", "hip"), fps, "file.x")


def test_what_has_no_gap_is_handed_through():
    positions = marching()
    result = whole(positions)
    assert result.positions is positions and not result.repairs and result.points.tolist() == [0, 1, 2, 3]


def test_gaps_in_a_straight_march_are_filled_without_a_trace_and_counted():
    positions = marching()
    positions[10:15, 0], positions[12, 2], positions[30:32, 3] = np.nan, np.nan, np.nan
    given = positions.copy()
    result = whole(positions)
    np.testing.assert_allclose(result.positions, marching(), atol=1e-9)
    assert [(r.count, r.of) for r in result.repairs] == [(5 + 1 + 2, "samples")]
    np.testing.assert_array_equal(positions, given)  # the caller's array stays


def test_one_lost_coordinate_is_a_lost_sample():
    """A marker of which only x is known is not where its y and z say."""
    positions = marching()
    positions[20, 0, 0], positions[20, 0, 1:] = np.nan, -9999.0
    np.testing.assert_allclose(whole(positions).positions, marching(), atol=1e-9)


@pytest.mark.parametrize("fps", [25.0, 30.0, 50.0, 60.0, 100.0, 120.0, 240.0])
def test_the_longest_gap_is_a_time_whatever_the_rate(fps):
    longest = int(REPAIR.gap_s * fps + 1e-9)
    positions = marching()
    positions[40 : 40 + longest, 0] = np.nan
    assert whole(positions, fps).repairs[0].count == longest
    positions[40 + longest, 0] = np.nan
    with pytest.raises(ClipError, match="point 'knee': found no data from"):
        whole(positions, fps)


def test_many_short_gaps_are_not_one_long_gap():
    positions = marching()
    positions[5:65:2, 0] = np.nan  # far more in all than the longest
    positions[70 : 70 + LONGEST, 0] = positions[85 : 85 + LONGEST, 0] = np.nan
    np.testing.assert_allclose(whole(positions).positions, marching(), atol=1e-9)


def test_a_point_that_nobody_needs_is_left_out_for_a_long_gap_and_the_others_keep_their_places():
    positions = marching()
    positions[40 : 41 + LONGEST, 1] = np.nan
    result = whole(positions)
    assert result.points.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(result.positions, marching()[:, [0, 2, 3]])
    assert [(r.count, r.of) for r in result.repairs] == [(1, "points")] and "stray" in result.repairs[0].what


def test_a_point_that_nobody_needs_is_left_out_where_nothing_lies_beyond_its_gap():
    positions = marching()
    positions[-1, 1] = np.nan
    assert whole(positions).points.tolist() == [0, 2, 3]
    assert whole(positions).frames == slice(0, 100)  # and costs no frame


def test_frames_at_the_ends_without_a_needed_point_are_cut_off():
    positions = marching()
    positions[:7, 0], positions[96:, 2] = np.nan, np.nan
    result = whole(positions)
    assert result.frames == slice(7, 96) and result.repairs[0].count == 7 + 4
    np.testing.assert_array_equal(result.positions, marching()[7:96])
    assert "left are 0.07 to 0.95 s" in result.repairs[0].where


def test_times_in_a_refusal_are_those_of_the_file_even_after_its_beginning_is_cut_off():
    positions = marching()
    positions[:7, 0], positions[50:70, 2] = np.nan, np.nan
    with pytest.raises(ClipError, match=r"file\.x, point 'hip': found no data from 0\.50 s to 0\.70 s"):
        whole(positions)


def test_a_needed_point_that_is_never_seen_is_named_and_one_that_is_never_seen_with_the_others_too():
    positions = marching()
    positions[:, 2] = np.nan
    with pytest.raises(ClipError, match=r"found hip never seen, expected all of knee, hip"):
        whole(positions)
    positions = marching()
    positions[:50, 0], positions[50:, 2] = np.nan, np.nan
    with pytest.raises(ClipError, match="no frame in which all needed points are seen"):
        whole(positions)
