"""Robots by name and by path: one robot is one object, however it is called."""

import os
import shutil

import platformdirs
import pytest
from any_pose import ASSETS, dancer_xml, profiled

from robot_models import (
    DEFAULT_ROBOT,
    RobotError,
    find_profile,
    installed,
    kept_in,
    load_robot,
    own_robots,
    robot_names,
)
from robot_models.profile import PROFILES


def test_names_are_sorted_and_each_finds_the_profile_of_its_name():
    assert list(robot_names()) == sorted(robot_names()) and DEFAULT_ROBOT in robot_names()
    assert [find_profile(n).name for n in robot_names()] == list(robot_names())


def test_robots_of_our_own_are_always_installed():
    own = [n for n in robot_names() if not find_profile(n).source.package]
    assert {"dancer", "g1"} <= set(own) and all(map(installed, own))


def test_a_robot_that_is_loaded_again_is_the_same_object(tmp_path, monkeypatch):
    assert load_robot() is load_robot(DEFAULT_ROBOT)
    path = profiled(tmp_path, dancer_xml())
    robot = load_robot(path)
    monkeypatch.chdir(tmp_path)
    for other in ("mine.toml", "./mine.toml", f"../{tmp_path.name}/mine.toml", "mine.xml"):
        assert load_robot(other) is robot, other
    assert robot is not load_robot("dancer")  # an equal one in another place


@pytest.mark.parametrize("suffix", [".urdf", ".xml", ".mjcf"])
def test_a_model_file_stands_for_the_profile_beside_it(tmp_path, suffix):
    profiled(tmp_path, dancer_xml())
    assert find_profile(str(tmp_path / f"mine{suffix}")) == find_profile(str(tmp_path / "mine.toml"))
    with pytest.raises(RobotError, match=r"yours\.toml: found no such file"):
        find_profile(str(tmp_path / f"yours{suffix}"))


def test_a_folder_full_of_robots_does_not_hide_the_built_in_ones(tmp_path, monkeypatch):
    shutil.copy(ASSETS / "g1.xml", tmp_path / "dancer.xml")
    shutil.copy(PROFILES / "g1.toml", tmp_path / "dancer.toml")
    monkeypatch.chdir(tmp_path)
    assert find_profile("dancer").title.startswith("dancer")


@pytest.mark.parametrize(("name", "near"), [("g11", "g1"), ("tallos", "talos"), ("daancer", "dancer")])
def test_a_name_that_is_nearly_right_is_answered_with_the_right_one(name, near):
    with pytest.raises(RobotError) as refusal:
        find_profile(name)
    assert refusal.value.cure == f"did you mean '{near}'?"


def test_a_name_that_is_like_none_gets_the_list_and_no_guess():
    with pytest.raises(RobotError, match=", ".join(robot_names())) as refusal:
        find_profile("xylophone")
    assert refusal.value.cure == "draft one of your own with 'dance-robot add'"


def test_a_users_own_robots_are_found_by_name_from_every_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setattr(platformdirs, "user_config_dir", lambda *_, **__: str(tmp_path / "config"))
    assert own_robots() == {}
    named, kept = tmp_path / "named", kept_in()
    for folder in (named, kept):
        folder.mkdir(parents=True)
        profiled(folder, dancer_xml())
    assert own_robots() == {"mine": kept / "mine.toml"}
    robot = load_robot("mine")
    assert robot is load_robot(str(kept / "mine.toml")) and find_profile("mine").folder == kept
    monkeypatch.setenv("DANCE_ROBOTS", f"{tmp_path / 'nowhere'}{os.pathsep}{named}")
    assert own_robots() == {"mine": named / "mine.toml"}  # what is named goes before what is kept
    (named / "g1.toml").write_text("")
    assert "g1" not in own_robots() and load_robot("g1").name == "g1"
    with pytest.raises(RobotError, match="did you mean 'mine'"):
        find_profile("minee")
