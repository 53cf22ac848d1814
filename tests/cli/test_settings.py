"""Settings by their dotted names, on the command line and in a file: each reaches its number, and nothing else does."""

import dataclasses
import tomllib

import pytest
from conftest import SAMPLES

from cli.retarget import main
from cli.retargeting import Arguments
from cli.shell import as_toml, from_file, from_words
from cli.shell.settings import split_dotted
from cli.shell.typed import remember
from cli.training import Arguments as Training
from retarget import RetargetConfig
from robot_models import DanceError
from tracking import TrainConfig


def stated(**dotted):
    remember("dance-x", [], {name.replace("__", ".").replace("_", "-"): text for name, text in dotted.items()})


def test_dotted_words_are_taken_out_and_the_rest_stays():
    words = ["a.bvh", "--contact.tight-speed", "0.3", "-o", "b.npz", "--weights.arm=12", "--end", "5.5", "--x=a.b"]
    assert split_dotted(words) == (
        ["a.bvh", "-o", "b.npz", "--end", "5.5", "--x=a.b"],
        {"contact.tight-speed": "0.3", "weights.arm": "12"},
    )


@pytest.mark.parametrize(
    ("dotted", "group", "name", "value"),
    [
        ({"contact__tight_speed": "0.3"}, "contact", "tight_speed", 0.3),
        ({"weights__arm": "12"}, "weights", "arm", 12.0),
        ({"whole_clip__limit_rounds": "7"}, "whole_clip", "limit_rounds", 7),
        ({"whole_clip__damping_range": "0.1,2"}, "whole_clip", "damping_range", (0.1, 2.0)),
    ],
)
def test_a_setting_reaches_its_number_and_no_other(dotted, group, name, value):
    stated(**dotted)
    config, base = from_words(RetargetConfig()), RetargetConfig()
    assert getattr(getattr(config, group), name) == value
    changed = dataclasses.replace(getattr(base, group), **{name: value})
    assert config == dataclasses.replace(base, **{group: changed})


def test_deeper_groups_switches_and_lists():
    stated(task__rewards__action_rate="0.2", ppo__hidden="64,32", task__randomisation__pushes="false")
    config = from_words(TrainConfig())
    assert config.task.rewards.action_rate == 0.2 and config.ppo.hidden == (64, 32)
    assert config.task.randomisation.pushes is False and config.task.randomisation.enabled


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("contact.tigt-speed", "1", "contact.tight-speed"),
        ("contacts.tight-speed", "1", "contact.tight-speed"),
        ("contact", "1", "a group of settings"),
        ("contact.tight-speed", "fast", "expected float"),
        ("contact.tight-speed", "true", "expected float"),
        ("contact.tight-speed", "-1", "at least 0"),
        ("contact.tight-speed", "nan", "at least 0"),
        ("dynamics", "1", "expected bool"),
        ("whole-clip.limit-rounds", "2.5", "expected int"),
        ("whole-clip.coarse.step-s.x", "1", "no such setting"),
        ("whole-clip.fine", "1", "a group of settings"),
        ("report", "1", "no such setting"),
    ],
)
def test_what_is_no_setting_or_no_value_of_it_is_refused_with_the_nearest(name, text, said):
    remember("dance-x", [], {name: text})
    with pytest.raises(DanceError, match=said):
        from_words(RetargetConfig())


@pytest.mark.parametrize("base", [RetargetConfig(), TrainConfig()])
def test_what_is_printed_reads_back_as_what_it_was(base, tmp_path):
    (tmp_path / "all.toml").write_text(as_toml(base))
    assert from_file(base, tmp_path / "all.toml") == base
    assert from_file(type(base)(), tmp_path / "all.toml") == base
    assert len(tomllib.loads(as_toml(base))) > 5


def test_a_word_beats_an_option_an_option_beats_the_file_and_the_file_the_default(tmp_path):
    (tmp_path / "c.toml").write_text("fps = 30.0\nlead_in_s = 0.2\nlead-out-s = 0.3\n[contact]\ntight_speed = 0.3\n")
    clips = (SAMPLES / "groove.bvh",)
    remember("dance-retarget", [], {"contact.tight-speed": "0.4"})
    numbers = Arguments(clips=clips, config=tmp_path / "c.toml", lead_in=0.7).numbers()
    assert (numbers.fps, numbers.lead_in_s, numbers.lead_out_s) == (
        30.0,
        0.7,
        0.3,
    ) and numbers.contact.tight_speed == 0.4
    remember("dance-train", [])
    (tmp_path / "t.toml").write_text("seed = 3\nenvs = 16\n")
    numbers = Training(ref=clips, config=tmp_path / "t.toml", envs=32).numbers()
    assert (numbers.seed, numbers.envs) == (3, 32)


@pytest.mark.parametrize("text", ["fps = ", "[contact]\ntight = 1", "contact = 1", "fps = 'x'", "[fps]\nx = 1"])
def test_a_file_that_says_something_else_is_refused(text, tmp_path):
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(DanceError):
        from_file(RetargetConfig(), tmp_path / "c.toml")


def test_the_command_takes_both_and_prints_them_all(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = [
        str(SAMPLES / "groove.bvh"),
        "--end",
        "1.5",
        "--no-recording",
        "--contact.tight-speed",
        "0.31",
        "--verbose",
    ]
    assert main(words) == 0
    assert "tight_speed = 0.31" in capsys.readouterr().out
    assert main([*words, "--contact.tigt-speed", "1"]) == 2
    assert "contact.tight-speed" in capsys.readouterr().err
    from cli.inspect import main as inspect

    with pytest.raises(SystemExit):  # a command without settings knows none
        inspect([str(SAMPLES / "groove.bvh"), "--contact.tight-speed", "1"])
