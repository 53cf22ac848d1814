"""What a name can do on a screen: nothing. What a closed pipe, a full disk or an old terminal does to the work: nothing."""

import os
import subprocess
import sys

import pytest
from conftest import ROOT, SAMPLES
from rich.table import Table
from rich.text import Text

from cli.shell.console import make_console

NAMES = [
    "a\x1b[2Jb", "right\u202eleft", "bell\x07", "back\x08", "[red]x[/]", "[/x]", "[link=x]y", ":smile:", "\x9b1m",
    "zero\u200bwidth",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_a_name_is_printed_and_does_nothing(name, capsys):
    screen = make_console()
    screen.print(f"wrote {name}")
    table = Table(box=None)
    table.add_column("name", no_wrap=True)
    table.add_row(name)
    screen.print(table)
    screen.print(name, style="red")
    shown = capsys.readouterr().out
    for hidden in ("\x1b", "\u202e", "\x07", "\x08", "\x9b", "\u200b", "\U0001f604"):
        assert hidden not in shown
    if name.isascii() and name.isprintable():
        assert shown.count(name) == 3  # markup is no markup, and a picture no picture


def test_styles_of_our_own_are_styles_still(capsys):
    screen = make_console(force_terminal=True)
    screen.print(Text("ok", style="green"), "good", style="bold")
    assert "\x1b[" in capsys.readouterr().out


def run(words, **options):
    return subprocess.run(
        [sys.executable, "-c", _script(words)], cwd=ROOT, capture_output=True, timeout=120, check=False, **options
    )


def _script(words):
    return f"import sys, cli.retarget as m; sys.exit(m.main({words!a}))"


@pytest.fixture
def clip(tmp_path):
    path = tmp_path / "clip.csv"
    path.write_text("\n".join((SAMPLES / "groove.csv").read_text().splitlines()[:80]) + "\n")
    return path


def test_a_reader_who_has_gone_does_not_stop_the_work(clip, tmp_path):
    out = tmp_path / "out.npz"
    child = subprocess.Popen(
        [sys.executable, "-c", _script([str(clip), "-o", str(out)])],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    child.stdout.close()
    _, said = child.communicate(timeout=120)
    assert out.exists() and b"Traceback" not in said and child.returncode in (0, 1)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_full_standard_output_does_not_stop_the_work(clip, tmp_path):
    out = tmp_path / "out.npz"
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-c", _script([str(clip), "-o", str(out)])], cwd=ROOT, stdout=full, stderr=subprocess.PIPE,
            timeout=120, check=False,
        )  # fmt: skip
    assert out.exists() and b"Traceback" not in done.stderr


def test_a_terminal_without_unicode_and_warnings_as_errors_are_no_errors(clip, tmp_path):
    named = clip.rename(tmp_path / "踊り.csv")
    env = os.environ | {"LC_ALL": "C", "PYTHONIOENCODING": "ascii", "PYTHONWARNINGS": "error"}
    done = run([str(named), "-o", str(tmp_path / "踊.npz")], env=env)
    assert done.returncode in (0, 1), done.stderr
    assert (tmp_path / "踊.npz").exists() and done.stdout.isascii() and b"\\u8e0a" in done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="names as bytes")
def test_a_name_that_is_no_utf_8_is_a_name(clip, tmp_path):
    raw = os.fsencode(tmp_path) + b"/clip_\xff.csv"
    os.rename(clip, raw)
    done = run([os.fsdecode(raw), "-o", str(tmp_path / "out.npz")])
    assert done.returncode in (0, 1), done.stderr
    assert (tmp_path / "out.npz").exists() and (tmp_path / "out.rrd").exists() and b"\\udcff" in done.stdout
