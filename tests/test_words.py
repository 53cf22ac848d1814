"""What the code says: no floor below the commands names their options, for a library has none."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OPTION = re.compile(r"(^|[\s'\"(])--[a-z]")
OF_OTHERS = ("ray start --head",)  # commands of other packages


def strings(tree):
    """Every text of a module but its docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docs = {
        id(n.body[0].value) for n in ast.walk(tree) if isinstance(n, documented) and isinstance(n.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node


@pytest.mark.parametrize("floor", ["robot_models", "clips", "retarget", "tracking"])
def test_no_floor_below_the_commands_names_their_options(floor):
    said = []
    for path in (ROOT / floor).rglob("*.py"):
        for node in strings(ast.parse(path.read_text())):
            text = node.value
            for known in OF_OTHERS:
                text = text.replace(known, "")
            if OPTION.search(text):
                said.append(f"{path.relative_to(ROOT)}:{node.lineno}: {text}")
    assert not said


def test_the_search_finds_an_option():  # the negative control
    found = [n.value for n in strings(ast.parse('"""--in-docs"""\nraise E("go on with --resume")'))]
    assert [bool(OPTION.search(t)) for t in found] == [True]
