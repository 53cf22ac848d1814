"""Robot files of strangers: a robot or a refusal, in seconds; names that stay in their folder, numbers that robots have."""

import os
import time
from functools import partial

import pytest

import robot_models.model_file as module
from robot_models import RobotError, load_robot, read_profile
from robot_models.profile import PROFILES

DANCER = (PROFILES / "dancer.toml").read_text()
BODY = "<body name='a'><freejoint/><geom size='0.1'/><body name='b'><joint name='j'/><geom size='0.1'/></body></body>"


def mjcf(world=BODY, rest=""):
    return f"<mujoco>{rest}<worldbody>{world}</worldbody></mujoco>"


def chain(links):
    inertial = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    bodies = "".join(f"<link name='l{k}'>{inertial}</link>" for k in range(links))
    joints = "".join(
        f"<joint name='j{k}' type='continuous'><parent link='l{k}'/><child link='l{k + 1}'/></joint>"
        for k in range(links - 1)
    )
    return f"<robot name='r'>{bodies}{joints}</robot>"


FILES = {
    "a field of a billion": mjcf(rest="<asset><hfield name='h' nrow='30000' ncol='30000' size='1 1 1 1'/></asset>"),
    "copies without end": mjcf(f"<replicate count='100000000'>{BODY}</replicate>"),
    "copies of copies": mjcf("<replicate count='1000'>" * 3 + BODY + "</replicate>" * 3),
    "a cloth of a billion": mjcf("<flexcomp name='f' type='grid' count='1000 1000 1000' spacing='1 1 1'/>"),
    "a chain of bodies": chain(3000),
    "entities": "<!DOCTYPE x [<!ENTITY a 'aaaaaaaaaa'>]><mujoco>&a;</mujoco>",
    "tags without end": "<mujoco>" + "<body>" * 100_000,
    "elements without end": mjcf("<geom size='0.1'/>" * 30_000),
    "no number": mjcf(BODY.replace("size='0.1'", "size='nan'")),
    "no end": mjcf(BODY.replace("size='0.1'", "size='0.1 inf 0.1'")),
    "a name that is a format": mjcf(BODY.replace("<geom ", "<geom class='a%nb' ", 1)),
    "an include of nothing": "<mujoco><include file='nowhere.xml'/></mujoco>",
    "an include of itself": "<mujoco><include file='r.xml'/></mujoco>",
}  # fmt: skip


@pytest.mark.parametrize("how", FILES)
def test_a_model_file_that_grows_or_says_no_numbers_is_refused_in_time(how, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "refusal_of_child", partial(module.refusal_of_child, seconds=2.5))
    (tmp_path / "r.xml").write_text(FILES[how])
    began = time.monotonic()
    with pytest.raises(RobotError):
        module.open_spec(tmp_path / "r.xml").compile()
    assert time.monotonic() - began < 8.0


@pytest.mark.parametrize("what", ["model", "include", "profile"])
@pytest.mark.parametrize("how", ["pipe", "device", "folder"])
def test_a_pipe_a_device_or_a_folder_is_no_robot_and_nobody_waits_for_it(what, how, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "refusal_of_child", partial(module.refusal_of_child, seconds=2.5))
    path = tmp_path / {"model": "r.xml", "include": "i.xml", "profile": "p.toml"}[what]
    {"pipe": os.mkfifo, "device": lambda p: p.symlink_to("/dev/zero"), "folder": os.mkdir}[how](path)
    if what == "include":
        (tmp_path / "r.xml").write_text("<mujoco><include file='i.xml'/></mujoco>")
    began = time.monotonic()
    with pytest.raises(RobotError):
        read_profile(path) if what == "profile" else module.open_spec(tmp_path / "r.xml")
    assert time.monotonic() - began < 8.0


def test_what_grows_within_reason_is_a_robot_still(tmp_path):
    (tmp_path / "i.xml").write_text(f"<mujoco>{BODY}</mujoco>")
    (tmp_path / "r.xml").write_text("<mujoco><worldbody><include file='i.xml'/></worldbody></mujoco>")
    assert len(module.open_spec(tmp_path / "r.xml").bodies) == 3


CHANGES = {
    "a path as name": ('name = "dancer"', 'name = "../../dancer"'),
    "an absolute path as name": ('name = "dancer"', 'name = "/tmp/dancer"'),
    "no name": ('name = "dancer"', 'name = ""'),
    "a name of nothing": ('name = "dancer"', 'name = "a\\u0000b"'),
    "a number as name": ('name = "dancer"', "name = 3"),
    "a name that clears the screen": ('name = "dancer"', 'name = "\\u001b[2J"'),
    "a title that clears the screen": ("title = ", 'title = "\\u001b[2J"\nold = '),
    "a pattern without end": ("[joints.kp]", '[joints.kp]\n"(.*)*x" = 1.0'),
    "many repeats": ("[joints.kp]", '[joints.kp]\n".*.*.*.*.*.*x" = 1.0'),
    "a broken pattern": ("[joints.kp]", '[joints.kp]\n"(" = 1.0'),
    "a gain of NaN": ("[joints.kp]", '[joints.kp]\n".*" = nan'),
    "a gain of inf": ("[joints.kp]", '[joints.kp]\n".*" = inf'),
    "a gain below 0": ("[joints.kp]", '[joints.kp]\n".*" = -1.0'),
    "a gain in words": ("[joints.kp]", '[joints.kp]\n".*" = "a"'),
    "a gain of truth": ("[joints.kp]", '[joints.kp]\n".*" = true'),
    "nesting": ("[joints.kp]", "x = " + "[" * 50_000),
    "landmarks of numbers": ("[landmarks]", "[landmarks]\npelvis = 3\n[old]"),
}  # fmt: skip


@pytest.mark.parametrize("how", CHANGES)
def test_a_profile_that_no_robot_has_is_refused_in_time(how, tmp_path):
    old, new = CHANGES[how]
    assert DANCER.count(old) >= 1
    (tmp_path / "p.toml").write_text(DANCER.replace(old, new, 1))
    began = time.monotonic()
    with pytest.raises(RobotError):
        load_robot(str(tmp_path / "p.toml"))
    assert time.monotonic() - began < 5.0
