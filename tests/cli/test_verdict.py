"""How a verdict is told: its line first, details on request, JSON for machines, and commands that can be typed again."""

import io
import json
import shlex
from pathlib import Path

import pytest
from any_pose import dancer_xml, profiled
from conftest import SAMPLES
from rich.console import Console

from cli.retarget import main
from cli.retargeting import Arguments
from cli.retargeting.stretches import stretches
from cli.shell import TellOptions, Trouble, Verdict, again, tell
from cli.shell.typed import remember, without
from retarget import Gates, RetargetConfig, RetargetError

GOOD = Verdict(
    passed=True, line="fine", numbers=("1 mm", "2 s"), steps=(("dance-x a", "look"), ("dance-longer b", "go"))
)
BAD = Verdict(
    passed=False, line="not fine", troubles=(Trouble(what="a hand", cures=(("leave it out", "dance-x --drop 1-2"),)),)
)


@pytest.mark.parametrize(("verdict", "code"), [(GOOD, 0), (BAD, 1), (Verdict(passed=False, line="odd", code=3), 3)])
def test_the_line_comes_first_and_the_exit_code_is_its_verdicts(verdict, code, capsys):
    assert tell(verdict, TellOptions(), ["a detail"]) == code
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"{'✓' if verdict.passed else '✗'} {verdict.line}" and "a detail" not in said


def test_details_come_when_asked_for_and_what_is_shown_always(capsys):
    tell(GOOD, TellOptions(verbose=True), ["a detail"], shown=["a table"])
    assert {"a detail", "a table"} <= set(capsys.readouterr().out.splitlines())


def test_a_terminal_without_signs_gets_words_and_a_pipe_no_colour():
    for encoding, mark in (("ascii", "below the gate: not fine"), ("utf-8", "✗ not fine")):
        bytes_out = io.BytesIO()
        stream = io.TextIOWrapper(bytes_out, encoding=encoding)
        tell(BAD, TellOptions(), console=Console(file=stream))
        stream.flush()
        assert bytes_out.getvalue().decode(encoding).splitlines()[0] == mark


def test_json_to_standard_output_leaves_it_to_the_machine(capsys, tmp_path):
    tell(BAD, TellOptions(json=tmp_path / "v.json"))
    tell(BAD, TellOptions(json=Path("-")))
    caught = capsys.readouterr()
    start = caught.out.index("{")
    told = json.loads(caught.out[start:])
    assert told == json.loads((tmp_path / "v.json").read_text())
    assert told["verdict"] == "not fine" and told["exit_code"] == 1
    assert told["troubles"] == [{"what": "a hand", "cures": [{"do": "leave it out", "command": "dance-x --drop 1-2"}]}]
    assert "✗ not fine" in caught.err


@pytest.mark.parametrize(
    ("words", "changes", "line"),
    [
        (["a.bvh"], {"--end": "5"}, "dance-x a.bvh --end 5"),
        (["a.bvh", "--end", "9", "-o", "b.npz"], {"--end": "5"}, "dance-x a.bvh -o b.npz --end 5"),
        (["a.bvh", "--end=9"], {"--end": "5"}, "dance-x a.bvh --end 5"),
        (
            ["my dance.bvh", "--drop", "1-2", "3-4"],
            {"--drop": "1-2 3-4 5-6"},
            "dance-x 'my dance.bvh' --drop 1-2 3-4 5-6",
        ),
        (["a.bvh", "--loud"], {"--loud": ""}, "dance-x a.bvh --loud"),
    ],
)
def test_a_command_is_proposed_again_with_every_word_and_the_change_once(words, changes, line):
    remember("dance-x", words)
    assert again(changes) == line


def test_an_option_is_taken_out_with_what_belongs_to_it():
    assert without(["a", "--x", "1", "b"], "--x") == ["a", "b"]
    assert without(["a", "--x", "1", "2", "--y"], "--x", 2) == ["a", "--y"]


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({}, [(0.0, None)]),
        ({"start": 2.0, "end": 9.0}, [(2.0, 9.0)]),
        ({"drop": ("3-4",)}, [(0.0, 3.0), (4.0, None)]),
        ({"drop": ("6-7", "3-4.5"), "end": 8.0}, [(0.0, 3.0), (4.5, 6.0), (7.0, 8.0)]),
        ({"drop": ("0-1", "3-5", "4-6")}, [(1.0, 3.0), (6.0, None)]),
        ({"drop": ("7-20",), "start": 1.0, "end": 9.0}, [(1.0, 7.0)]),
    ],
)
def test_what_is_left_when_seconds_are_dropped(given, kept):
    assert stretches(Arguments(clips=(SAMPLES / "groove.bvh",), **given)) == kept


@pytest.mark.parametrize("drop", ["3", "4-3", "a-b", "3-4-5", "-1-2", "nan-2", "1-inf", "0-100"])
def test_what_is_no_stretch_of_seconds_is_refused(drop):
    with pytest.raises(RetargetError):
        stretches(Arguments(clips=(SAMPLES / "groove.bvh",), drop=(drop,), end=50.0))


@pytest.fixture
def strict_slides(monkeypatch):
    """A gate that no dance holds."""
    monkeypatch.setattr("cli.retargeting.arguments.RetargetConfig", lambda: RetargetConfig(gates=Gates(slide_mm=0.0)))


def test_a_missed_gate_says_when_and_proposes_commands_that_can_be_typed(strict_slides, tmp_path, monkeypatch, capsys):
    import tyro

    monkeypatch.chdir(tmp_path)
    assert main([str(SAMPLES / "groove.bvh"), "--end", "4", "--speed", "0.9"]) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("✗ groove.bvh on dancer") and "1 of 9 gates missed" in said[0]
    assert any("slides" in line and " from " in line for line in said)
    proposed = [line[line.index("dance-retarget") :] for line in said if ": dance-retarget " in line]
    assert proposed
    for line in proposed:
        words = shlex.split(line)[1:]
        assert words.count("--speed") == 1
        tyro.cli(Arguments, args=words, config=(tyro.conf.OmitArgPrefixes,))


def test_motors_that_no_pace_is_slow_enough_for_are_not_told_to_be_slowed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lame = profiled(tmp_path, dancer_xml(), ('".*" = 20.0\n', '".*" = 0.02\n'))
    assert main([str(SAMPLES / "groove.bvh"), "--robot", lame, "--end", "3"]) == 1
    said = capsys.readouterr().out
    assert (
        "--speed" not in said
        and f"no pace is slow enough for these motors: what does its profile say of them?: dance-robot check {lame}"
        in said
    )


def test_the_recording_of_a_missed_gate_has_its_lane_its_list_and_no_passing_one_has(
    strict_slides, tmp_path, monkeypatch
):
    from clips import cut, read_clip
    from retarget import retarget
    from robot_models import load_robot

    clip, robot = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 2.0), load_robot("dancer")
    for gates, there in ((Gates(), False), (Gates(slide_mm=0.0), True)):
        path = tmp_path / f"{there}.rrd"
        retarget(clip, robot, RetargetConfig(gates=gates)).save(path)
        data = path.read_bytes()
        assert (b"gates/slide-per-touch-worst" in data) == there and (b"/bookmarks" in data) == there
        assert (b"world/wrong/slide-per-touch-worst" in data) == there


def test_dropped_seconds_are_gone_and_the_seam_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([str(SAMPLES / "groove.bvh"), "--end", "6", "--drop", "2-4", "--no-recording", "-o", "d.npz"]) == 0
    assert "seam at 3." in capsys.readouterr().out
    from clips import load_reference

    first, second = load_reference(tmp_path / "d.npz").dances
    assert (first.stop - first.start, second.stop - second.start) == (101, 101)


def test_an_option_stated_twice_is_refused_and_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = [
        str(SAMPLES / "groove.bvh"),
        "--start",
        "1",
        "--end",
        "2",
        "--then",
        str(SAMPLES / "groove.csv"),
        "--end=3",
    ]
    assert main(words) == 2
    assert "--end: found it twice" in capsys.readouterr().err


def test_a_refusal_is_told_to_machines_too(tmp_path, capsys):
    assert main([str(tmp_path / "none.bvh"), "--json", "-"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert told["exit_code"] == 2 and "none.bvh: found no such file" in told["verdict"]


def test_dances_one_after_the_other_are_not_told_to_drop_seconds_of_the_first(
    strict_slides, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    clip = str(SAMPLES / "groove.bvh")
    assert main([clip, "--end", "2", "--then", clip, "--no-recording", "-o", "t.npz"]) == 1
    assert "--drop" not in capsys.readouterr().out
