"""Tables: cells keep their columns, names their numbers, and the rate is the file's, whatever stands around."""

from pathlib import Path

import numpy as np
import pytest
from stick_person import tagged

from clips import ClipError
from clips.provenance import RawFile
from clips.readers.table import header, looks_like_table, parse

NAMES = ("a", "b", "c", "d")
VALUES = tagged(12, 4)


def raw(text):
    return RawFile(path=Path("t.csv"), data=text.encode() if isinstance(text, str) else text)


def rows(values=VALUES, names=NAMES, separator=","):
    lines = [separator.join(names)] if names else []
    return lines + [separator.join("" if np.isnan(v) else f"{v:.12g}" for v in row) for row in values]


def text(*extra, **told):
    return "\n".join([*extra, *rows(**told)]) + "\n"


def timed(times, first="time"):
    return text(values=np.column_stack((times, VALUES[: len(times)])), names=(first, *NAMES))


def test_an_empty_cell_is_lost_and_moves_no_other():
    values = VALUES.copy()
    values[3, 1] = values[5, 0] = values[7, 3] = np.nan
    table = parse(raw(text(values=values)))
    np.testing.assert_array_equal(table.values, values)
    np.testing.assert_array_equal(table.column("c"), VALUES[:, 2])


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_the_separator_changes_no_number_and_is_noted_where_it_is_rare(separator):
    table = parse(raw(text(separator=separator)))
    np.testing.assert_array_equal(table.values, VALUES)
    assert table.columns == NAMES and bool(table.notes) == (separator != ",")


def test_names_and_numbers_are_told_apart_alike_by_the_glance_and_by_the_reading():
    for names in (NAMES, (), ("0", "1", "2", "3"), ("x1", "2", "3", "4")):
        file = raw(text(names=names))
        assert looks_like_table(file) and header(file) == parse(file).columns
    assert parse(raw(text(names=("0", "1", "2", "3")))).values.shape == (13, 4)  # numbers are a frame


@pytest.mark.parametrize("line", ["# fps: 25", "#fps=25", "# Frame_Rate : 25.0", "# frame rate: 2.5e1"])
def test_a_rate_line_is_read_in_any_spelling(line):
    table = parse(raw(text("# made by hand", line)))
    assert table.fps == 25.0
    np.testing.assert_array_equal(table.values, VALUES)


def test_without_a_rate_there_is_none_and_a_rate_of_nothing_is_refused():
    assert parse(raw(text())).fps is None
    with pytest.raises(ClipError, match="'# fps:' line.*a number above 0") as refusal:
        parse(raw(text("# fps: 0")))
    assert refusal.value.option == "fps"


@pytest.mark.parametrize("name", ["time", "T", "Timestamp", "time_s", "seconds"])
def test_a_time_column_gives_the_rate_wherever_it_begins_and_is_no_data(name):
    for begin in (0.0, 1234.5):
        table = parse(raw(timed(begin + np.arange(12) / 40, first=name)))
        assert table.fps == pytest.approx(40.0) and table.columns == NAMES
        np.testing.assert_array_equal(table.values, VALUES)


def test_a_time_column_may_stand_anywhere():
    values = np.insert(VALUES, 2, np.arange(12) / 40, axis=1)
    table = parse(raw(text(values=values, names=("a", "b", "t", "c", "d"))))
    np.testing.assert_array_equal(table.values, VALUES)
    assert table.columns == NAMES


def test_rows_of_a_repeated_time_are_left_out_and_counted():
    again = np.concatenate((np.arange(6), [5, 5], np.arange(6, 10))) / 40
    table = parse(raw(timed(again)))
    np.testing.assert_array_equal(table.values, np.delete(VALUES, [6, 7], axis=0))
    assert [r.count for r in table.repairs] == [2] and table.fps == pytest.approx(40.0)


def test_uneven_times_of_points_are_evened_along_straight_lines(rng):
    times = np.arange(12) / 40 + np.concatenate(([0], rng.uniform(-0.008, 0.008, 10), [0]))
    march = 50.0 * times[:, None] + 100.0 * np.arange(4)
    file = raw(text(values=np.column_stack((times, march)), names=("time", *NAMES)))
    table = parse(file, named_points=True)
    np.testing.assert_allclose(
        table.values, 50.0 * np.arange(12)[:, None] / 40 + 100.0 * np.arange(4), atol=1e-3
    )  # of %g
    assert "even grid" in table.repairs[0].what
    with pytest.raises(ClipError, match="uneven time stamps.*rotations"):
        parse(file)


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (np.arange(12)[::-1] / 40, "time column, frame 2: found time that runs backwards"),
        (np.where(np.arange(12) == 7, 0.0, np.arange(12) / 40), "frame 8: found time that runs backwards"),
        (np.arange(12) * 25.0, "milliseconds"),
        (np.zeros(12), "one instant"),
        (np.arange(12) / 40 + (np.arange(12) > 5), "nothing between 0.125 s and 1.15 s"),
    ],
    ids=["back", "back once", "ms", "one", "hole"],
)  # fmt: skip
def test_times_that_are_none_are_refused(times, said):
    with pytest.raises(ClipError, match=said):
        parse(raw(timed(times)), named_points=True)


def test_the_faulty_cell_is_named_by_its_row_in_the_file_comments_and_all():
    lines = ["# one", "", "# two", *rows()]
    lines[3 + 1 + 4] = lines[3 + 1 + 4].replace("204", "two hundred")
    with pytest.raises(ClipError, match=r"t\.csv, row 9, column 3: found 'two hundred', expected a number"):
        parse(raw("\n".join(lines)))
    lines = rows()
    lines[6] += ",1"
    with pytest.raises(ClipError, match="row 7: found 5 columns, expected 4 as in the first row"):
        parse(raw("\n".join(lines)))


@pytest.mark.parametrize("separator", [",", ";", " "])
def test_a_short_row_is_refused_and_not_filled_up(separator):
    lines = rows(separator=separator)
    lines[3] = lines[3].rsplit(separator, 1)[0]
    with pytest.raises(ClipError, match="row 4: found 3 columns, expected 4"):
        parse(raw("\n".join(lines)))


@pytest.mark.parametrize("separator", [",", ";", " "])
def test_a_short_row_beside_a_long_one_is_not_evened_out(separator):
    lines = rows(separator=separator)
    # The number of separators in all is right.
    lines[3], lines[5] = lines[3].rsplit(separator, 1)[0], lines[5] + separator + "1"
    with pytest.raises(ClipError, match="row [46]"):
        parse(raw("\n".join(lines)))


@pytest.mark.parametrize(("content", "rows_said"), [("", "0"), ("a,b,c\n", "1"), ("1,2,3", "1"), ("# fps: 30\n", "0")])
def test_less_than_two_lines_are_no_motion(content, rows_said):
    with pytest.raises(ClipError, match=f"found {rows_said} rows"):
        parse(raw(content))


def test_bytes_and_single_words_are_no_table():
    assert not looks_like_table(raw(b"a,b\0,c\n1,2,3\n"))
    assert not looks_like_table(raw("HIERARCHY\nROOT\n")) and not looks_like_table(raw("# only, a, comment\n"))


def test_a_last_empty_column_is_dropped_but_not_an_empty_one_within():
    trailing = "\n".join(line + "," for line in rows())
    table = parse(raw(trailing))
    assert table.columns == NAMES and "empty last column dropped" in table.notes
    values = VALUES.copy()
    values[:, 1] = np.nan
    assert parse(raw(text(values=values))).values.shape == (12, 4)
