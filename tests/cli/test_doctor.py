"""`dance-doctor`: what is missing is named with the line that installs it, and only what is needed is a failure."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from cli import doctor
from cli.shell import made_for

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(doctor, "_robots", lambda: {"dancer": (True, "28 joints"), "ghost": (False, "no model file")})


def told(monkeypatch, capsys, parts):
    monkeypatch.setattr(doctor, "PARTS", parts)
    code = doctor.main([])
    return code, capsys.readouterr().out


def test_what_it_looks_for_is_what_the_package_asks_for():
    """Two sources: its own table, and the package's dependencies."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

    def names(lines):
        return {re.split(r"[ \[<>=;!~]", line)[0] for line in lines}

    for extra, (_, parts) in doctor.PARTS.items():
        asked = names(project["dependencies"] if extra == "base" else project["optional-dependencies"][extra])
        assert {distribution for distribution, _ in parts} <= asked, extra


@pytest.mark.parametrize("python", [(3, 11), (3, 12), (3, 13), (3, 14)])
@pytest.mark.parametrize("world", [("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64"), ("win32", "AMD64")])
def test_what_is_made_for_other_machines_is_what_the_package_leaves_out_there(world, python):
    """Two sources: the table, and the markers of the package's dependencies."""
    from packaging.requirements import Requirement

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"], *(r for extra in project["optional-dependencies"].values() for r in extra)]
    there = {"sys_platform": world[0], "platform_machine": world[1], "python_version": f"{python[0]}.{python[1]}"}
    for requirement in map(Requirement, asked):
        if requirement.name != "atheris":  # of tests alone
            fits = requirement.marker is None or requirement.marker.evaluate(there)
            assert fits == (not made_for(requirement.name, *world, python)), requirement


def test_what_has_no_wheel_for_this_machine_is_told_without_a_line_that_cannot_help(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "made_for", lambda _: "the moon")
    parts = {"deploy": ("wires", (("no-such-package", "nothing"),))}
    code, said = told(monkeypatch, capsys, parts)
    assert code == 0 and "no-such-package: has no wheel for this machine, for the moon" in said
    assert "pip install" not in said


def test_all_there_is_all_well(monkeypatch, capsys):
    code, said = told(monkeypatch, capsys, {"base": ("retargeting", (("numpy", "numpy"), ("scipy", "")))})
    assert code == 0 and "2 packages" in said and "pip install" not in said
    assert f"Python {sys.version.split()[0]}" in " ".join(said.split())


@pytest.mark.parametrize(("extra", "code"), [("base", 1), ("train", 0)])
def test_a_missing_package_is_named_with_its_cure_and_fails_only_what_cannot_do_without(
    monkeypatch, capsys, extra, code
):
    what = "retargeting" if extra == "base" else "policies"
    parts = {
        "base": ("retargeting", (("numpy", "numpy"),)),
        extra: (what, (("no-such-package", "nothing"), ("numpy", "numpy"))),
    }
    got, said = told(monkeypatch, capsys, parts)
    assert got == code and "no-such-package missing" in said
    wanted = "'dance-retarget'" if extra == "base" else "'dance-retarget[train]'"
    assert f"pip install -c tested-versions.txt {wanted}   for {what}" in said


def test_a_package_that_is_there_and_broken_is_not_well(monkeypatch, tmp_path):
    (tmp_path / "broken_part.py").write_text("raise RuntimeError('libfoo.so is missing')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert "does not import (RuntimeError: libfoo.so is missing)" in doctor._state("numpy", "broken_part")
    assert doctor._state("numpy", "numpy").endswith(" ok")
    assert doctor._state("no-such-package", "numpy") == "no-such-package missing"


def test_robots_that_do_not_load_are_told_and_fail_nothing(monkeypatch, capsys):
    code, said = told(monkeypatch, capsys, {})
    assert code == 0
    rows = {line.split("robot ")[1].split()[0]: line for line in said.splitlines() if "robot " in line}
    assert rows["dancer"].startswith("ok") and rows["ghost"].startswith("--") and "no model file" in rows["ghost"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems have a display")
@pytest.mark.parametrize("name", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_a_display_is_one_of_either_kind(monkeypatch, name):
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    assert doctor._machine()["display"].startswith("none")
    monkeypatch.setenv(name, ":0")
    assert doctor._machine()["display"] == "here"
