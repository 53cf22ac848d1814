"""What is wrong with a model file is told at once, and what of it is left out is told too."""

import mujoco
import pytest
from any_pose import dancer_xml

from robot_models import RobotError
from robot_models.draft import draft_profile


def test_everything_that_is_wrong_is_told_at_once(tmp_path):
    """One page, and not one fault an attempt."""
    spec = mujoco.MjSpec.from_string(dancer_xml())
    for name in ("left_elbow", "right_elbow"):
        spec.joint(name).limited = mujoco.mjtLimited.mjLIMITED_FALSE
    (tmp_path / "free.xml").write_text(spec.to_xml())
    spec.delete(spec.body("left_shoulder_pitch_link"))
    (tmp_path / "armless.xml").write_text(spec.to_xml())
    with pytest.raises(RobotError, match="no position limit for left_elbow, right_elbow"):
        draft_profile(tmp_path / "free.xml", "x", tmp_path / "x.toml")
    with pytest.raises(
        RobotError, match=r"no two legs and two arms.*and no position limit for right_elbow.*write the ranges"
    ):
        draft_profile(tmp_path / "armless.xml", "x", tmp_path / "x.toml")


def test_xacro_is_called_by_its_name(tmp_path):
    (tmp_path / "r.urdf.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>'
    )
    with pytest.raises(RobotError, match=r"found xacro.*expand it first: xacro r\.urdf\.xacro > r\.urdf"):
        draft_profile(tmp_path / "r.urdf.xacro", "x", tmp_path / "x.toml")


def test_linkages_are_told_and_left_out(tmp_path):
    spec = mujoco.MjSpec.from_string(dancer_xml())
    spec.add_equality(name="pair", type=mujoco.mjtEq.mjEQ_JOINT, name1="left_elbow", name2="right_elbow",
                      objtype=mujoco.mjtObj.mjOBJ_JOINT)  # fmt: skip
    (tmp_path / "tied.xml").write_text(spec.to_xml())
    draft = draft_profile(tmp_path / "tied.xml", "x", tmp_path / "x.toml")
    assert any("linkages: left_elbow and right_elbow by an equality are left out" in guess for guess in draft.guesses)
    (tmp_path / "plain.xml").write_text(dancer_xml())
    assert not any("linkages" in g for g in draft_profile(tmp_path / "plain.xml", "x", tmp_path / "y.toml").guesses)
