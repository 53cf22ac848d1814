"""What every command shares: refusals in two lines, and a line to try that the command understands."""

import shlex
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from typing import Annotated

import pytest
import tyro
from conftest import ROOT

from cli.shell.options import FileOptions
from cli.shell.terminal import command, option_names
from robot_models import DanceError


@dataclass(frozen=True, kw_only=True)
class Inner:
    """A sub-command."""

    depth: int = 0
    """How deep."""


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """A command."""

    robot: str = "dancer"
    """A robot."""
    do: Annotated[Annotated[Inner, tyro.conf.subcommand("inner")] | None, tyro.conf.arg(name="")] = None
    """What."""
    file: FileOptions = field(default_factory=FileOptions)


def test_options_of_groups_and_sub_commands_are_the_commands():
    assert {"robot", "depth", "fps", "source_robot", "strict"} <= option_names(Arguments)
    assert "rehearse" not in option_names(Arguments)


@pytest.mark.parametrize(
    ("option", "suggestion", "told"),
    [
        ("robot", "g1", "try: dance-x --robot g1"),
        ("source_robot", "g1", "try: dance-x --robot talos --source-robot g1"),
        ("robot", "", "see: dance-x --help, --robot"),
        ("rehearse", "yes", None),  # another command's
        ("", "", None),
    ],
)
def test_a_refusal_names_an_option_only_where_the_command_has_it(option, suggestion, told, capsys):
    def body(_):
        raise DanceError("here", found="this", expected="that", cure="mend it", option=option, suggestion=suggestion)

    assert command(Arguments, body, name="dance-x", argv=["--robot", "talos"]) == 2
    first, *rest = capsys.readouterr().err.splitlines()
    assert first == "refused: here: found this, expected that; mend it"
    assert rest == ([] if told is None else [told])
    if told and told.startswith("try"):
        seen = []
        command(Arguments, lambda a: seen.append(a) or 0, name="dance-x", argv=shlex.split(told)[2:])
        assert seen  # the line to try is understood


def test_an_interruption_ends_with_its_own_code(capsys):
    def body(_):
        raise KeyboardInterrupt

    assert command(Arguments, body, name="dance-x", argv=[]) == 130
    assert capsys.readouterr().err == "stopped\n"


def test_who_stops_a_command_while_it_imports_is_told_in_a_word():
    program = "import cli, os, signal; os.kill(os.getpid(), signal.SIGINT); import time; time.sleep(5)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert done.stderr == "stopped\n" and done.returncode in (130, -signal.SIGINT)
    broken = subprocess.run([sys.executable, "-c", "import cli; 1 / 0"], capture_output=True, text=True, cwd=ROOT)
    assert "ZeroDivisionError" in broken.stderr and "Traceback" in broken.stderr
