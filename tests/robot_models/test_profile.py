"""Profiles: numbers go to the joints that a pattern names whole, soles are what their edges say, gaps are refused."""

import dataclasses
import re

import numpy as np
import pytest

from robot_models import LANDMARKS, RobotError, read_profile
from robot_models.profile import FEET, PROFILES, Sole, expand_patterns

JOINTS = ["left_knee", "right_knee", "left_knee_roll", "waist"]
DANCER = (PROFILES / "dancer.toml").read_text()


def test_a_pattern_names_whole_joints_and_not_their_beginnings():
    assert expand_patterns({".*": 1.0, "left_knee": 2.0}, JOINTS, where="kp") == [2.0, 1.0, 1.0, 1.0]


def test_of_two_patterns_the_later_wins_wherever_they_stand():
    table = {"left_.*": 1.0, ".*_knee": 2.0, "right_.*": 3.0, "waist": 4.0}
    assert expand_patterns(table, JOINTS, where="kp") == [2.0, 3.0, 1.0, 4.0]
    assert expand_patterns(dict(reversed(table.items())), JOINTS, where="kp") == [1.0, 2.0, 1.0, 4.0]


def test_values_follow_the_joints_into_any_order():
    table = {".*knee": 1.0, ".*roll": 2.0, "waist": 3.0}
    values = dict(zip(JOINTS, expand_patterns(table, JOINTS, where="kp"), strict=True))
    assert expand_patterns(table, JOINTS[::-1], where="kp") == [values[j] for j in reversed(JOINTS)]


def test_joints_that_need_no_number_have_none():
    assert expand_patterns({"waist": 3.0}, JOINTS, where="damping", cover=False) == [0.0, 0.0, 0.0, 3.0]
    with pytest.raises(RobotError, match=r"kp: found no value for left_knee, right_knee, left_knee_roll"):
        expand_patterns({"waist": 3.0}, JOINTS, where="kp")


def test_heel_and_toe_are_the_middles_of_the_back_and_front_corners():
    sole = Sole(body="foot", x=(-0.1, 0.2), y=(-0.03, 0.05), z=-0.06, points=())
    back, front = sole.corners[:2], sole.corners[2:]
    np.testing.assert_allclose(sole.heel, back.mean(axis=0))
    np.testing.assert_allclose(sole.toe, front.mean(axis=0))
    assert len(np.unique(sole.corners, axis=0)) == 4 and (back[:, 0] < front[:, 0]).all()
    assert not np.allclose(sole.heel, sole.toe)  # negative control


@pytest.mark.parametrize("path", sorted(PROFILES.glob("*.toml")), ids=lambda p: p.stem)
def test_every_profile_stands_on_points_of_its_own_soles_and_names_each_landmark_once(path):
    profile = read_profile(path)
    assert (profile.name, profile.folder) == (path.stem, PROFILES)
    assert tuple(profile.landmarks) == LANDMARKS
    for sole in (profile.soles[s] for s in FEET):
        x, y = np.transpose(sole.points)
        slack = 1e-9  # points on an edge
        assert (x >= sole.x[0] - slack).all() and (x <= sole.x[1] + slack).all()
        assert (y >= sole.y[0] - slack).all() and (y <= sole.y[1] + slack).all()
    assert len(set(profile.tracked)) == len(profile.tracked) and profile.anchor in profile.tracked
    for left in (k for k in LANDMARKS if k.startswith("left_")):
        assert profile.landmarks[left] != profile.landmarks[left.replace("left", "right")]


@pytest.mark.parametrize("entry", ["title", "root", "name"])
def test_a_missing_entry_is_refused_by_name(tmp_path, entry):
    (tmp_path / "p.toml").write_text(re.sub(rf"^{entry} = .*\n", "", DANCER, count=1, flags=re.MULTILINE))
    with pytest.raises(RobotError, match=f"no entry '{entry}'.*docs/robots.md"):
        read_profile(tmp_path / "p.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[soles.right]", "[soles.rihgt]", "no entry 'right'"),
        ("[joints.kp]", "[joints.pk]", "no entry 'kp'"),
        ("friction = 0.9", 'friction = "much"', "the wrong kind.*much"),
        ('licence = "Apache-2.0"', 'license = "Apache-2.0"', "the wrong kind.*licen[cs]e"),
        ("points = [[-0.06, -0.04]", "points = [[-0.06, -0.04, 0.0]", "the wrong kind"),
        ("[landmarks]", "[landmarks", "cannot be read"),
        ('left_wrist = "left_wrist_yaw_link"', "", "no entry 'left_wrist'"),
    ],
)
def test_a_mistyped_profile_is_refused(tmp_path, old, new, said):
    assert old in DANCER
    (tmp_path / "p.toml").write_text(DANCER.replace(old, new))
    with pytest.raises(RobotError, match=said):
        read_profile(tmp_path / "p.toml")


def test_an_absent_profile_is_refused_and_a_read_one_does_not_change(tmp_path):
    with pytest.raises(RobotError, match=r"no\.toml: found no such file"):
        read_profile(tmp_path / "no.toml")
    with pytest.raises(dataclasses.FrozenInstanceError):
        read_profile(PROFILES / "dancer.toml").friction = 2.0
