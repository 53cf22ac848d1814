"""What every command shares: flags named after options, refusals with the line to type, exit codes, progress."""

import dataclasses
import shlex
import sys
from dataclasses import dataclass

import pytest
import tyro
from rich.console import Console

from cli.retargeting.report_table import report_table
from cli.shell.options import FileOptions
from cli.shell.progress_bar import progress
from cli.shell.terminal import BELOW_GATE, DONE, REFUSED, command, complain, flag, option_names
from cli.shell.typed import remember
from clips import MetricKey, ReadOptions
from clips.identify.mapping import UnknownSkeletonError
from retarget import Report
from retarget.report import Metric
from robot_models import DanceError

OPTIONS = option_names(FileOptions)


def complained(error, words):
    remember("dance-test", words)
    complain(error, OPTIONS)


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Do something.

    Examples:
        dance-test
    """

    file: FileOptions = dataclasses.field(default_factory=FileOptions)


@dataclass(frozen=True, kw_only=True)
class Plain:
    """Do something else."""

    fps: float = 30.0
    loud: bool = False


def refusing(**more):
    def body(args):
        raise DanceError("clip.csv", found="x", expected="y", **more)

    return body


def run(body, words=()):
    return command(Plain, body, name="dance-test", argv=list(words))


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(ReadOptions)])
def test_every_option_of_the_readers_has_a_flag_by_which_it_can_be_given(field):
    """The flag that a refusal names is one that the commands take, and its value arrives where the reader looks."""
    value = {
        "fps": "31.0",
        "up": "-y",
        "stature": "1.5",
        "quat_order": "xyzw",
        "joint_order": "isaac",
        "unit": "cm",
        "level": "False",
        "travel": "from-feet",
        "travel_scale": "100.0",
    }.get(field, "a")
    word = f"--no-{field}" if value == "False" else f"{flag(field)}={value}"
    options = tyro.cli(FileOptions, args=[word], config=(tyro.conf.OmitArgPrefixes,)).reading()
    given = {f.name: getattr(options, f.name) for f in dataclasses.fields(ReadOptions)}
    assert str(given.pop(field)) == value and set(given.values()) == {None}


@pytest.mark.parametrize("code", [DONE, BELOW_GATE, REFUSED])
def test_what_a_command_comes_to_is_its_exit_code(code):
    assert run(lambda args: code) == code


def test_words_come_from_the_command_line_where_none_are_given(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["dance-test", "--fps", "25"])
    seen = []
    assert command(Plain, lambda args: seen.append(args.fps) or DONE, name="dance-test", argv=None) == DONE
    assert seen == [25.0]


def test_ctrl_c_is_130_as_shells_have_it(capsys):
    def body(args):
        raise KeyboardInterrupt

    assert run(body) == 130
    assert capsys.readouterr().err == "stopped\n"


def test_a_refusal_is_exit_code_2_and_on_stderr_alone(capsys):
    assert run(refusing(cure="do z")) == REFUSED
    told = capsys.readouterr()
    assert told.out == "" and told.err == "refused: clip.csv: found x, expected y; do z\n"


def test_a_fault_of_ours_is_not_dressed_up_as_a_refusal():
    def body(args):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(body)


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--loud"],
        ["--fps", "25"],
        ["--fps", "25", "--loud"],
        ["--loud", "--fps", "25"],
        ["--fps=25"],
    ],
)
def test_the_line_to_type_keeps_every_word_and_has_the_option_once_with_its_new_value(words, capsys):
    assert run(refusing(option="fps", suggestion="30"), words) == REFUSED
    line = capsys.readouterr().err.splitlines()[1]
    typed = shlex.split(line.removeprefix("try: "))
    assert typed[0] == "dance-test" and typed[-2:] == ["--fps", "30"]
    assert sum(w.startswith("--fps") for w in typed) == 1 and typed.count("--loud") == words.count("--loud")
    args = tyro.cli(Plain, args=typed[1:])  # and it can be typed
    assert args == Plain(fps=30.0, loud="--loud" in words)


def test_words_with_spaces_come_back_quoted(capsys):
    words = ["my clip.csv", "-o", "it's here.npz"]
    complained(DanceError("a", found="b", expected="c", option="fps", suggestion="30"), words)
    line = capsys.readouterr().err.splitlines()[1]
    assert shlex.split(line)[2:] == [*words, "--fps", "30"]


def test_a_suggestion_with_spaces_comes_quoted_too(capsys):
    error = UnknownSkeletonError("my dance.bvh", ["a"], ["left_hip"], {})
    complained(error, ["my dance.bvh"])
    assert shlex.split(capsys.readouterr().err.splitlines()[1])[-2:] == ["--mapping", "my dance.mapping.toml"]


def test_an_option_without_a_value_to_propose_is_pointed_at(capsys):
    complained(DanceError("a", found="b", expected="c", option="quat_order"), ["x"])
    assert capsys.readouterr().err.splitlines()[1] == "see: dance-test --help, --quat-order"


def test_brackets_in_a_refusal_are_text_and_no_markup(capsys):
    complained(DanceError("a[red].csv", found="[bold]", expected="pip install 'x[y]'"), [])
    assert "a[red].csv: found [bold], expected pip install 'x[y]'" in capsys.readouterr().err


def test_an_unknown_skeleton_leaves_a_draft_to_confirm_and_never_writes_over_one(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    error = UnknownSkeletonError("odd.bvh", ["a", "b"], ["left_hip"], {"left_hip": "a"})

    def body(args):
        raise error

    assert command(Arguments, body, name="dance-test", argv=[]) == REFUSED
    file = tmp_path / "odd.mapping.toml"
    assert file.read_text() == error.draft and [p.name for p in tmp_path.iterdir()] == [file.name]
    assert "try: dance-test --mapping odd.mapping.toml" in " ".join(capsys.readouterr().err.split())
    file.write_text("mine")
    assert command(Arguments, body, name="dance-test", argv=[]) == REFUSED
    assert file.read_text() == "mine" and "left as it is" in capsys.readouterr().err


def test_a_log_is_told_a_line_a_quarter_of_a_minute_and_each_stage_by_itself(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr("cli.shell.progress_bar.time.monotonic", lambda: now[0])
    with progress("frames") as tell:
        for stage in ("first", "second"):
            for done in range(0, 101, 10):
                tell(stage, done, 100)
                now[0] += 2.0
    lines = capsys.readouterr().err.splitlines()
    assert 2 <= len(lines) <= 44 / 15.0 + 1
    assert any(line.startswith("first: ") for line in lines) and any(line.startswith("second: ") for line in lines)
    for line in lines:  # 10 frames in 2 s: what is left takes a fifth of it
        done = int(line.split(": ")[1].split("/")[0])
        assert f"{(100 - done) / 5:.0f} s to go" in line and "/100 frames" in line


def test_a_report_marks_gates_that_hold_and_that_do_not_and_no_others(capsys):
    def metric(key, value, limit):
        return Metric(key=key, value=value, unit="mm", meaning="", limit=limit)

    good, bad, told = MetricKey.PENETRATION, MetricKey.SELF_COLLISION, MetricKey.AIRBORNE
    report = Report(metrics=(metric(good, 1.0, 2.0), metric(bad, 3.0, 2.0), metric(told, 4.0, None)), series={})
    Console(width=100).print(report_table(report))
    rows = {line.split(" mm")[0].strip(): line for line in capsys.readouterr().out.splitlines()[1:]}
    assert [line.split()[0] for line in rows.values()] == ["ok", "FAIL", "airborne"]


def test_a_command_describes_itself_and_takes_its_options_without_prefixes(capsys):
    with pytest.raises(SystemExit) as e:
        command(Arguments, lambda args: DONE, name="dance-test", argv=["--help"])
    said = capsys.readouterr().out
    assert e.value.code == 0 and "Do something." in said and "--quat-order" in said and "--file." not in said
