"""Examples run as they stand, in an empty folder, are short, and are checked for types."""

import ast
import json
import subprocess
import sys

import pytest
from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))


def test_examples_are_numbered_and_short():
    assert [path.name[:2] for path in EXAMPLES] == [f"{k:02}" for k in range(1, len(EXAMPLES) + 1)] and len(
        EXAMPLES
    ) >= 6
    assert all(len(path.read_text().splitlines()) < 40 for path in EXAMPLES)


SLOW = [path for path in EXAMPLES if "train" in path.name]


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.slow] * (path in SLOW), id=path.name) for path in EXAMPLES],
)
def test_it_runs(path, tmp_path):
    if "train" in path.name:
        pytest.importorskip("torch")
    done = subprocess.run(
        [sys.executable, str(path)], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_every_cell_of_a_notebook_runs_and_what_it_ends_with_shows_itself(path, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    cells = [c for c in json.loads(path.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]
    names: dict[str, object] = {}
    for cell in cells:
        assert not cell["outputs"] and cell["execution_count"] is None  # as a reader finds it
        *body, last = ast.parse("".join(cell["source"])).body
        exec(compile(ast.Module(body, []), path.name, "exec"), names)
        if isinstance(last, ast.Expr):
            shown = eval(compile(ast.Expression(last.value), path.name, "eval"), names)
            assert len(repr(shown)) < 300
        else:
            exec(compile(ast.Module([last], []), path.name, "exec"), names)
    assert len(NOTEBOOKS) == 2
