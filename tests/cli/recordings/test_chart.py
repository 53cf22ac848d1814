"""The picture of a sweep: every cell where it belongs."""

import re
import sys
from types import SimpleNamespace

import pytest

from cli.recordings.chart import save_sweep
from clips import OutputError

ENGINES = ("mujoco", "physx-motor")
ROWS = {
    name: {e: SimpleNamespace(result=SimpleNamespace(finished=share)) for e, share in zip(ENGINES, shares, strict=True)}
    for name, shares in {"nominal": (1.0, 0.97), "delay 40 ms": (0.5, 0.03), "mass 1.2": (0.25, 0.0)}.items()
}


def texts(path):
    """What stands in an SVG, in order: matplotlib writes each text beside its outlines."""
    return re.findall(r"<!-- (.*?) -->", path.read_text())


def test_conditions_are_rows_engines_columns_and_shares_per_cent(tmp_path):
    pytest.importorskip("matplotlib")
    save_sweep(tmp_path / "s.svg", ROWS, ENGINES, "a dance")
    seen = texts(tmp_path / "s.svg")
    assert seen == [*ENGINES, *ROWS, "100", "97", "50", "3", "25", "0", "a dance"]
    save_sweep(tmp_path / "t.svg", ROWS, ENGINES[::-1], "a dance")
    assert texts(tmp_path / "t.svg")[5:11] == ["97", "100", "3", "50", "0", "25"]  # another order, the same cells


def test_every_share_stands_in_the_row_and_column_that_it_is_of(tmp_path):
    pytest.importorskip("matplotlib")
    save_sweep(tmp_path / "s.svg", ROWS, ENGINES, "a dance")
    placed = re.findall(r"<!-- (.*?) -->\s*<g[^>]*translate\(([\d.]+) ([\d.]+)\)", (tmp_path / "s.svg").read_text())
    at = {text: (float(x), float(y)) for text, x, y in placed}
    # Left to right, and down the page; texts are centred, so that neighbours in a column differ by their widths.
    cells = [["100", "97"], ["50", "3"], ["25", "0"]]
    for name, row in zip(ROWS, cells, strict=True):
        assert all(at[cell][1] == pytest.approx(at[name][1], abs=5.0) for cell in row)
        assert at[name][0] < at[row[0]][0] < at[row[1]][0]
    for column in zip(*cells, strict=True):
        assert max(at[c][0] for c in column) - min(at[c][0] for c in column) < 15.0


@pytest.mark.parametrize(("name", "begins"), [("s.png", b"\x89PNG"), ("s.pdf", b"%PDF"), ("s", b"\x89PNG")])
def test_the_files_name_says_its_format_and_png_is_what_none_means(tmp_path, name, begins):
    pytest.importorskip("matplotlib")
    save_sweep(tmp_path / name, ROWS, ENGINES, "a dance")
    assert (tmp_path / name).read_bytes().startswith(begins) and [p.name for p in tmp_path.iterdir()] == [name]


def test_without_matplotlib_the_line_that_installs_it_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(OutputError, match=r"no matplotlib.*pip install 'dance-retarget\[sim2sim\]'"):
        save_sweep(tmp_path / "s.png", ROWS, ENGINES, "a dance")
    assert not list(tmp_path.iterdir())
