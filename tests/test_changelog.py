"""What a user can see is listed in public_surface.txt, and does not change without a line in CHANGELOG.md.

`python tests/test_changelog.py` writes the list anew; it refuses while the newest section of the log is as the list knew it.
"""

import hashlib
import importlib
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
LIST = Path(__file__).parent / "public_surface.txt"
PACKAGES = ("robot_models", "clips", "retarget", "tracking")


def newest_section(log: str) -> tuple[str, str]:
    """Release and text of the first section of the log."""
    found = re.search(r"^## (\S+)\n(.*?)(?=^## |\Z)", log, re.M | re.S)
    assert found
    return found[1], found[2].strip()


def surface() -> list[str]:
    """Commands with their options, names that the packages export, keys of the report: one thing a line."""
    from cli.shell.terminal import option_names
    from clips import MetricKey

    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    lines = [f"report: {key}" for key in MetricKey]
    for command, entry in scripts.items():
        module = importlib.import_module(entry.split(":")[0])
        lines += [command, *(f"{command} {name}" for name in option_names(module.Arguments))]
    for package in PACKAGES:
        lines += [f"{package}.{name}" for name in importlib.import_module(package).__all__]
    return sorted(lines)


def digest(section: str) -> str:
    return hashlib.sha256(" ".join(section.split()).encode()).hexdigest()[:16]


def listed(lines: list[str], section: str, before: str) -> str:
    """The new list; refused where it differs from the one before and the log says nothing more than it did then."""
    known, *old = before.splitlines() or [""]
    if old and old != lines and known == digest(section):
        raise SystemExit("CHANGELOG.md has no line for: " + ", ".join(sorted(set(old) ^ set(lines))))
    return "\n".join([digest(section), *lines]) + "\n"


def test_what_users_see_is_what_the_log_was_written_for():
    _, *old = LIST.read_text().splitlines()
    changed = sorted(set(old) ^ set(surface()))
    assert not changed, f"say it in CHANGELOG.md, then run python {Path(__file__).relative_to(ROOT)}: {changed}"


def test_a_change_without_a_line_is_not_listed():
    before = listed(["a", "b"], "- one", "")
    assert listed(["a", "b"], "- one", before) == before
    with pytest.raises(SystemExit, match="no line for: b, c"):
        listed(["a", "c"], "- one", before)
    assert listed(["a", "c"], "- one\n- b is c now", before).splitlines()[1:] == ["a", "c"]


def test_the_newest_section_is_of_this_release_and_says_something():
    from robot_models import __version__

    release, text = newest_section((ROOT / "CHANGELOG.md").read_text())
    assert release == __version__ and text.count("\n- ") > 3
    with pytest.raises(AssertionError):
        newest_section("# Changelog\n")


def test_every_command_tells_its_release(capsys):
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    for command, entry in scripts.items():
        assert importlib.import_module(entry.split(":")[0]).main(["--version"]) == 0
        assert re.fullmatch(rf"{command} \d+\.\d+\.\d+\n", capsys.readouterr().out)


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))  # the folders of tests have the packages' names
    section = newest_section((ROOT / "CHANGELOG.md").read_text())[1]
    LIST.write_text(listed(surface(), section, LIST.read_text() if LIST.is_file() else ""))
