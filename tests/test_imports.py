"""The house stands on its floors: nothing imports upward, and every public name exists."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FLOORS = ["robot_models", "clips", "retarget", "tracking", "cli"]


def imported(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {a.name.split(".")[0] for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.split(".")[0])
    return found


@pytest.mark.parametrize("floor", FLOORS)
def test_a_package_imports_only_floors_below(floor):
    above = set(FLOORS[FLOORS.index(floor) + 1 :])
    for path in (ROOT / floor).rglob("*.py"):
        assert not imported(path) & above, path


def test_torch_stays_in_tracking_and_rerun_in_one_module():
    for floor in FLOORS:
        for path in (ROOT / floor).rglob("*.py"):
            names = imported(path)
            assert "torch" not in names or floor == "tracking" or path.name == "torch_motion.py", path
            assert "rerun" not in names or path.name == "scene.py", path


@pytest.mark.parametrize("floor", ["robot_models", "clips", "retarget"])
def test_every_public_name_exists(floor):
    module = importlib.import_module(floor)
    assert all(hasattr(module, n) for n in module.__all__)


def test_retarget_is_light_to_import():
    code = (
        "import sys, retarget; print([m for m in ('torch', 'rerun', 'mink', 'trimesh', 'pandas') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    assert out.strip() == "[]"
