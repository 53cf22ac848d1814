"""Where the training packages are not installed, commands that need them refuse in one line and name the extra."""

import subprocess
import sys

import pytest
from conftest import ROOT

from cli.shell.extras import refusal_of

AWAY = """
import importlib, sys

class Away:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {"torch", "rsl_rl", "gymnasium", "onnx", "onnxruntime", "sapien", "tensorboard"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Away())
sys.exit(importlib.import_module("cli." + sys.argv[1]).main(sys.argv[2:]))
"""


@pytest.mark.parametrize("words", [
    "train --ref FILE", "evaluate groove-dancer", "play groove-dancer", "export groove-dancer -o OUT",
    "deploy groove-dancer --rehearse",
])  # fmt: skip
def test_a_command_that_needs_an_extra_names_it(words, groove_file, tmp_path):
    named = [w.replace("FILE", str(groove_file)).replace("OUT", str(tmp_path / "out")) for w in words.split()]
    environment = {"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", AWAY, *named], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 2, done.stderr
    assert "dance-retarget[train]" in done.stderr and "Traceback" not in done.stderr


def test_a_package_that_no_extra_brings_is_a_fault_of_ours():
    with pytest.raises(ModuleNotFoundError, match="nowhere"):
        refusal_of(ModuleNotFoundError("nowhere", name="nowhere"))
    assert "[sim2sim]" in str(refusal_of(ModuleNotFoundError("x", name="sapien.core")))
