"""CSV and its kin as names and numbers: separators, headers, time columns and frame rates."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.errors import ClipError
from clips.provenance import FASTEST, SLOWEST, RawFile, Repair

_RATE = re.compile(r"^#\s*(?:fps|frame[_ ]?rate)\s*[:=]\s*([0-9.eE+-]+)\s*$", re.IGNORECASE)
_TIME = {"time", "t", "time_s", "timestamp", "time(s)", "times", "sec", "seconds"}
_MARK = b"\xef\xbb\xbf"
_MAX_JITTER = 0.05  # of a frame
_LONGEST_HOLE_S = 0.1
WIDEST = 10_000  # columns


@dataclass(frozen=True, kw_only=True)
class Table:
    """Numbers of a table with the names of their columns, and its frame rate where the file tells one."""

    raw: RawFile
    columns: tuple[str, ...]  # () without a header
    values: ndarray  # (T, C), NaN where a cell is empty; the time column is taken out
    fps: float | None
    fps_why: str
    notes: tuple[str, ...]  # how the text is laid out, where that is out of the ordinary
    repairs: tuple[Repair, ...] = ()

    def column(self, name: str) -> ndarray:
        """One column by name."""
        return np.asarray(self.values[:, self.columns.index(name)])


def looks_like_table(raw: RawFile) -> bool:
    """Text whose first line that is no comment has two or more cells."""
    if b"\0" in raw.head:
        return False
    for line in raw.head.decode("utf-8", errors="replace").splitlines():
        if line.strip() and not line.startswith("#"):
            return len(_split(line, _separator(line))) >= 2
    return False


def header(raw: RawFile) -> tuple[str, ...]:
    """The cells of the first line that is no comment, if they are names; else ()."""
    lines = (x for x in raw.head.decode("utf-8", errors="replace").splitlines() if x.strip() and not x.startswith("#"))
    line = next(lines, "")
    cells = tuple(c.strip().strip('"') for c in _split(line, _separator(line)))
    return () if all(_is_number(c, _separator(line)) for c in cells if c) else cells


def parse(raw: RawFile, *, named_points: bool = False) -> Table:
    """Split a table into names and numbers; uneven time stamps are evened out for named points only.

    Raises:
        ClipError: ragged rows, text among the numbers, or time that runs backwards.
    """
    data = raw.data.removeprefix(_MARK)
    notes = ["byte-order mark dropped"] if len(data) < len(raw.data) else []
    # Most files have no line to leave out, and an hour of them is not worth a look at each.
    if not data.isascii() or b"#" in data or b"\n\n" in data or b"\r" in data or data[:1].isspace():
        data = "\n".join(line for line in raw.text().splitlines() if not _empty(line)).encode()
    end = data.find(b"\n")
    if end < 0 or end + 1 == len(data):
        raise ClipError(raw.name, found=f"{int(bool(data))} rows", expected="a row per frame")
    head = data[:end].decode()
    rates = [
        m.group(1) for line in raw.head.decode(errors="replace").splitlines()[:20] if (m := _RATE.match(line.strip()))
    ]
    separator = _separator(head)
    if separator != ",":
        notes.append(f"separator {separator!r}")
    first = [c.strip().strip('"') for c in _split(head, separator)]
    if len(first) > WIDEST:
        raise ClipError(raw.name, found=f"{len(first)} columns", expected=f"at most {WIDEST}: a body has no more")
    has_header = not all(_is_number(c, separator) for c in first if c)
    columns = tuple(first) if has_header else ()
    values = _numbers(data, int(has_header), len(first), separator)
    if values is None:
        raise _fault(raw, has_header, len(first), separator)
    if (not columns or columns[-1] == "") and values.shape[1] > 1 and np.isnan(values[:, -1]).all():
        columns, values = columns[:-1], values[:, :-1]
        notes.append("empty last column dropped")
    table = Table(raw=raw, columns=columns, values=values, fps=None, fps_why="", notes=tuple(notes))
    return _with_rate(table, rates, named_points)


def number_rows(raw: RawFile, lines: Sequence[str], *, first: int, width: int, separator: str) -> Float[ndarray, "T W"]:
    """The rows of numbers under a header of several lines; an empty cell is NaN.

    Args:
        raw: the file, for messages.
        lines: of the whole file.
        first: the place of the first row; empty lines are left out.
        width: columns of every row; empty cells behind them are dropped, and ones that are missing at its end are empty.
        separator: between the cells.

    Raises:
        ClipError: a row that is wider, text among the numbers, no row.
    """
    rows = []
    for k, line in enumerate(lines[first:], start=first + 1):
        if not line.strip():
            continue
        cells = line.rstrip("\r\n").split(separator)
        if len(cells) > width and any(c.strip() for c in cells[width:]):
            raise ClipError(f"{raw.name}, line {k}", found=f"{len(cells)} cells", expected=f"{width}")
        try:
            row = [float(c) if c.strip() else np.nan for c in cells[:width]]
        except ValueError as e:
            raise ClipError(f"{raw.name}, line {k}", found=f"text among the numbers ({e})", expected="numbers") from e
        rows.append(row + [np.nan] * (width - len(row)))
    if not rows:
        raise ClipError(raw.name, found="no row", expected="a row per frame")
    return np.array(rows)


def _separator(line: str) -> str:
    """Semicolon or tab before comma: where they stand, commas are decimal points."""
    return next((s for s in (";", "\t", ",") if s in line), " ")


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    return next(csv.reader([line], delimiter=separator))


def _is_number(cell: str, separator: str) -> bool:
    try:
        float(cell.replace(",", ".") if separator != "," else cell)
        return True
    except ValueError:
        return False


def _empty(line: str) -> bool:
    """Nothing, or a comment."""
    return not line or line.isspace() or line.lstrip()[:1] == "#"


def _numbers(data: bytes, skip: int, width: int, separator: str) -> ndarray | None:
    """All cells but those of the first `skip` rows as floats; None for a table that is ragged or holds text."""
    import pandas as pd

    # pandas fills short rows up and refuses long ones: with the right number of separators in all, neither is there.
    rows = data.count(b"\n") + (not data.endswith(b"\n"))
    if separator == " ":
        even = all(len(row.split()) == width for row in data.split(b"\n") if row)
    else:
        even = data.count(separator.encode()) == (width - 1) * rows
    if not even:
        return None
    try:
        frame = pd.read_csv(
            io.BytesIO(data), header=None, skiprows=skip, sep=r"\s+" if separator == " " else separator,
            decimal="," if separator != "," and re.search(rb"\d,\d", data) else ".", dtype=float, skipinitialspace=True,
        )  # fmt: skip
    except ValueError:
        return None
    return np.asarray(frame.to_numpy(dtype=float))


def _fault(raw: RawFile, has_header: bool, width: int, separator: str) -> ClipError:
    """The first row that is no row of numbers."""
    rows = [(i + 1, line) for i, line in enumerate(raw.text().splitlines()) if not _empty(line)]
    for number, line in rows[has_header:]:
        cells = _split(line, separator)
        if len(cells) != width:
            return ClipError(
                f"{raw.name}, row {number}", found=f"{len(cells)} columns", expected=f"{width} as in the first row"
            )
        for k, cell in enumerate(cells):
            if cell.strip() and not _is_number(cell.strip(), separator):
                return ClipError(f"{raw.name}, row {number}, column {k + 1}", found=f"'{cell}'", expected="a number")
    return ClipError(raw.name, found="a table that does not parse", expected="plain numbers, one row per frame")


def _with_rate(table: Table, rates: list[str], named_points: bool) -> Table:
    """Take the frame rate from a '# fps:' line or a time column."""
    where = table.raw.name
    if rates:
        fps = float(rates[0])
        if not fps > 0:
            raise ClipError(f"{where}, '# fps:' line", found=rates[0], expected="a number above 0", option="fps")
        table = replace(table, fps=fps, fps_why=f"'# fps: {fps:g}' line")
    times = [i for i, c in enumerate(table.columns) if c.strip().lower() in _TIME]
    if not times:
        return table
    time = table.values[:, times[0]]
    rest = [i for i in range(len(table.columns)) if i != times[0]]
    table = replace(table, columns=tuple(table.columns[i] for i in rest), values=table.values[:, rest])
    steps = np.diff(time)
    if not np.isfinite(time).all() or (steps < 0).any():
        row = int(np.flatnonzero(~(steps >= 0))[0]) + 2 if len(steps) else 1
        raise ClipError(
            f"{where}, time column, frame {row}",
            found="time that runs backwards or is missing",
            expected="rising times",
        )
    keep = np.concatenate(([True], steps > 0))
    if not keep.all():
        table = replace(
            table,
            values=table.values[keep],
            repairs=(*table.repairs, Repair(what="rows of a repeated time left out", count=int((~keep).sum()))),
        )
        time = time[keep]
    if len(time) < 2:
        raise ClipError(where, found="one instant", expected="several frames")
    dt = float(np.median(np.diff(time)))
    if not 1.0 / FASTEST <= dt <= 1.0 / SLOWEST:
        raise ClipError(
            f"{where}, time column", found=f"a step of {dt:g}", expected="seconds between frames",
            cure="write the times in seconds (these look like milliseconds?)" if dt >= 1.0 else "check the times",
            option="fps", suggestion="30",
        )  # fmt: skip
    wide = int(np.argmax(np.diff(time)))
    if time[wide + 1] - time[wide] > max(_LONGEST_HOLE_S, 2.5 * dt):
        raise ClipError(
            f"{where}, time column", found=f"nothing between {time[wide]:g} s and {time[wide + 1]:g} s",
            expected=f"holes of at most {_LONGEST_HOLE_S} s", cure="cut the file there",
        )  # fmt: skip
    dt = (time[-1] - time[0]) / (len(time) - 1)
    if np.abs(time - time[0] - dt * np.arange(len(time))).max() > _MAX_JITTER * dt:
        if not named_points:
            raise ClipError(
                f"{where}, time column", found="uneven time stamps", expected="even ones: rotations cannot be "
                "interpolated by column", cure="resample the recording before writing it",
            )  # fmt: skip
        even = np.linspace(time[0], time[-1], len(time))
        values = np.stack([np.interp(even, time, v) for v in table.values.T], axis=1)
        repair = Repair(what="uneven time stamps brought to an even grid", count=len(even))
        table = replace(table, values=values, repairs=(*table.repairs, repair))
    return replace(table, fps=float(1.0 / dt), fps_why=f"time column, {len(time)} rows over {time[-1] - time[0]:.4g} s")
