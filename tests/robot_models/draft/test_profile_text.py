"""A profile drafted from a model file alone: held against profiles made by hand, and tried on strangers."""

import json
import re
import sysconfig
from pathlib import Path

import mujoco
import numpy as np
import pytest
from any_pose import dancer_xml
from conftest import SHARED
from smpl_like import mjcf

from robot_models import FEET, RobotError, forward_kinematics, load_robot
from robot_models.draft.profile_text import draft_profile, without_overlaps
from robot_models.profile import PROFILES, read_profile

ASSETS = PROFILES.parent / "assets"
SHARE = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"


def added(model, out):
    draft = draft_profile(model, out.stem, out)
    out.write_text(draft.text)
    draft = without_overlaps(draft, out)
    out.write_text(draft.text)
    return load_robot(str(out)), draft


@pytest.mark.parametrize("name", ["dancer", "g1"])
def test_a_draft_finds_what_the_profile_made_by_hand_says(tmp_path, name):
    known = load_robot(name)
    robot, draft = added(ASSETS / f"{name}.xml", tmp_path / f"{name}.toml")
    assert robot.joint_names == known.joint_names
    pos, _ = forward_kinematics(known, np.concatenate(([0, 0, 1, 1, 0, 0, 0], np.zeros(len(known.joint_names))))[None])
    place = {b: pos[0, i] for i, b in enumerate(known.body_names)}
    for landmark, body in known.profile.landmarks.items():
        drafted = robot.profile.landmarks[landmark]
        assert drafted == body or np.linalg.norm(place[drafted] - place[body]) < 1e-6, landmark
    for side in FEET:
        a, b = robot.soles[side], known.soles[side]
        assert a.body == b.body
        if name == "dancer":  # G1's file of primitives has no soles; its meshes have
            assert a.z == pytest.approx(b.z, abs=1e-3)
            np.testing.assert_allclose([*a.x, *a.y], [*b.x, *b.y], atol=0.006)
    assert any("velocity" in g for g in draft.guesses)  # an MJCF has none
    assert draft.text.count("GUESSED") >= 6


def test_what_was_drafted_does_not_touch_itself_where_it_stands(tmp_path):
    from robot_models.geometry import self_collisions

    robot, _ = added(ASSETS / "dancer.xml", tmp_path / "r.toml")
    assert self_collisions(robot, robot.default_qpos[None]).depth[0] == 0.0


def changed(tmp_path, *changes):
    text = (ASSETS / "dancer.xml").read_text()
    for pattern, new in changes:
        text, count = re.subn(pattern, new, text)
        assert count, pattern
    path = tmp_path / "stranger.xml"
    path.write_text(text)
    return path


def turned(tmp_path, quat):
    """The dancer with its root turned inside a body that carries it."""
    spec = mujoco.MjSpec.from_file(str(ASSETS / "dancer.xml"))
    root = spec.worldbody.first_body()
    for child in root.bodies:
        pos, _ = np.array(child.pos), child.quat
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, np.array(quat, dtype=float))
        child.pos = turn.reshape(3, 3) @ pos
        out = np.zeros(4)
        mujoco.mju_mulQuat(out, np.array(quat, dtype=float), np.array(child.quat))
        child.quat = out
    path = tmp_path / "turned.xml"
    path.write_text(spec.to_xml())
    return path


def test_a_robot_that_lies_at_zero_is_refused(tmp_path):
    with pytest.raises(RobotError, match="stands along z"):
        draft_profile(turned(tmp_path, (0.7071068, 0.7071068, 0, 0)), "r", tmp_path / "r.toml")


@pytest.mark.parametrize("degrees", [90, 180, -90])
def test_a_robot_that_faces_elsewhere_is_turned_to_face_ahead(tmp_path, degrees, dancer):
    half = 0.5 * np.radians(degrees)
    robot, draft = added(turned(tmp_path, (np.cos(half), 0, 0, np.sin(half))), tmp_path / "r.toml")
    assert np.isclose(np.cos(robot.profile.source.yaw + np.radians(degrees)), 1.0)
    assert any("is turned to face +x" in guess for guess in draft.guesses)
    # At zero it is the robot that it was turned from: every body is where it was, left on the left.
    (ours, turns), (theirs, _) = (forward_kinematics(r, r.zero_qpos[None]) for r in (robot, dancer))
    for name in ("left_foot", "right_wrist", "head"):
        a, b = robot.landmark(name), dancer.body(robot.profile.landmarks[name])
        np.testing.assert_allclose(ours[0, a] - ours[0, 0], theirs[0, b] - theirs[0, 0], atol=1e-5)
    for side in FEET:
        np.testing.assert_allclose(np.abs(turns[0, robot.landmark(f"{side}_foot")]), [1.0, 0.0, 0.0, 0.0], atol=1e-5)


def test_a_joint_without_a_range_is_refused_by_name(tmp_path):
    path = changed(tmp_path, (r'(name="left_knee"[^>]*?) range="[^"]*"', r'\1 limited="false"'))
    with pytest.raises(RobotError, match="no position limit for left_knee"):
        draft_profile(path, "r", tmp_path / "r.toml")


def test_arms_that_end_at_the_elbow_get_a_wrist_at_the_end_of_the_forearm(tmp_path):
    spec = mujoco.MjSpec.from_file(str(ASSETS / "dancer.xml"))
    for side in FEET:
        spec.delete(spec.body(f"{side}_wrist_roll_link"))
    path = tmp_path / "nowrist.xml"
    path.write_text(spec.to_xml())
    draft = draft_profile(path, "r", tmp_path / "r.toml")
    (tmp_path / "r.toml").write_text(draft.text)
    profile = read_profile(tmp_path / "r.toml")
    assert profile.landmarks["left_wrist"] == profile.landmarks["left_elbow"] == "left_elbow_link"
    assert 0.1 < np.linalg.norm(profile.ends["left_wrist"]) < 0.3
    assert any("'left_elbow_link' ends at the elbow" in guess for guess in draft.guesses)
    assert load_robot(str(tmp_path / "r.toml")).landmark("right_wrist")


def test_a_root_on_slides_and_hinges_is_a_free_one(tmp_path):
    xml = dancer_xml()
    slides = "".join(f'<joint name="root_{k}" type="{t}" axis="{a}"/>' for k, (t, a) in enumerate(
        [("slide", "1 0 0"), ("slide", "0 1 0"), ("slide", "0 0 1"), ("hinge", "1 0 0"), ("hinge", "0 1 0"), ("hinge", "0 0 1")]
    ))  # fmt: skip
    bound = re.sub(r"<freejoint[^>]*/>|<joint[^>]*type=\"free\"[^>]*/>", slides, xml, count=1)
    assert bound != xml
    bound = bound.replace("</mujoco>", '<actuator><motor joint="root_2"/></actuator></mujoco>')
    (tmp_path / "slid.xml").write_text(bound)
    text = draft_profile(tmp_path / "slid.xml", "r", tmp_path / "r.toml").text
    (tmp_path / "r.toml").write_text(text)
    robot = load_robot(str(tmp_path / "r.toml"))
    assert robot.nq == 7 + len(robot.joint_names) and not any(name.startswith("root") for name in robot.joint_names)


@pytest.mark.parametrize(
    ("model", "elbow"),
    [
        ("booster_t1/T1_serial.xml", "left_hand_link"), ("fourier_n1/n1_mocap.xml", "left_lower_arm_pitch_link"),
        ("unitree_h1/h1.xml", "left_elbow_link"), ("unitree_r1/R1.urdf", "left_elbow_link"),
        ("tienkung2_lite/tienkung2_lite.urdf", "elbow_pitch_l_link"), ("nao/nao.urdf", "LForeArm"),
    ],
)  # fmt: skip
def test_robots_that_nobody_prepared_have_their_elbows_where_they_bend(model, elbow, tmp_path):
    path = SHARED.parent / "robots" / model
    if not path.is_file():
        pytest.skip("the shared robots are not on this machine")
    (tmp_path / "r.toml").write_text(draft_profile(path, "r", tmp_path / "r.toml").text)
    assert read_profile(tmp_path / "r.toml").landmarks["left_elbow"] == elbow


def test_a_body_model_of_balls_has_its_shoulders_beyond_the_collar_bones_and_its_wrists_before_the_hands(tmp_path):
    (tmp_path / "smpl.xml").write_text(mjcf())
    robot, _ = added(tmp_path / "smpl.xml", tmp_path / "smpl.toml")
    found = {name: body for name, body in robot.profile.landmarks.items() if name.startswith("left")}
    assert found == {
        "left_hip": "L_Hip", "left_knee": "L_Knee_y", "left_foot": "L_Ankle",
        "left_shoulder": "L_Shoulder", "left_elbow": "L_Elbow", "left_wrist": "L_Wrist",
    }  # fmt: skip
    assert (
        robot.default_joint_pos[robot.joint("L_Knee_y")] > 0.2 and not robot.default_joint_pos[robot.joint("L_Knee_x")]
    )
    assert not any("Hand" in name or "Toe" in name for name in robot.joint_names)


def test_what_is_no_humanoid_is_refused(tmp_path):
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body name="a"><freejoint/><geom size=".1"/><body name="b" pos="0 0 .3"><joint name="j"'
        ' range="-90 90"/><geom size=".1"/></body></body></worldbody></mujoco>'
    )
    with pytest.raises(RobotError, match="no two legs and two arms"):
        draft_profile(tmp_path / "arm.xml", "arm", tmp_path / "arm.toml")


def test_ranges_that_differ_left_and_right_are_doubted(tmp_path):
    path = changed(tmp_path, (r'(name="left_knee"[^>]*? range=)"[^"]*"', r'\1"-0.1 0.9"'))
    draft = draft_profile(path, "r", tmp_path / "r.toml")
    assert any("left_knee's and right_knee's differ" in g for g in draft.guesses)
    plain = draft_profile(ASSETS / "dancer.xml", "r", tmp_path / "r.toml")
    assert not any("differ" in g for g in plain.guesses)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "slow"),
    [
        ("romeo_description/urdf/romeo_small.urdf", True),  # its joints are too slow for the drill
        ("talos_data/robots/talos_full_v2.urdf", False),
        ("g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf", False),
    ],
)
def test_a_strangers_urdf_dances_at_once_or_is_told_to_be_slow(tmp_path, file, slow, capsys, monkeypatch):
    if not (SHARE / file).is_file():
        pytest.skip("example-robot-data is not installed")
    from cli.robot import main
    from robot_models.geometry import body_geoms

    monkeypatch.chdir(tmp_path)
    assert main(["add", str(SHARE / file), "--name", "unprofiled", "-o", "unprofiled.toml", "--json", "v.json"]) == int(
        slow
    )
    said = capsys.readouterr().out
    assert "stands 3.0 of 3 s" in said and said.startswith("✗" if slow else "✓")
    told = json.loads((tmp_path / "v.json").read_text())
    assert "is the robot that slow?" in str(told["troubles"]) if slow else not told["troubles"]
    assert told["report"]["limb_direction_error"]["value"] < 6.0
    assert (tmp_path / "unprofiled_check.rrd").stat().st_size > 1e5
    # What cannot touch cannot fail: every thick link has a surface.
    robot = load_robot(str(tmp_path / "unprofiled.toml"))
    dressed = {robot.model.body(int(robot.model.geom_bodyid[g])).name for g in body_geoms(robot)}
    assert {robot.profile.landmarks[k] for k in ("left_knee", "right_knee", "torso")} <= dressed


def test_a_profile_written_anew_is_a_new_robot(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir()
    robots = {}
    for folder, name in (("a", "dancer"), ("b", "g1")):  # one name in two folders
        monkeypatch.chdir(tmp_path / folder)
        Path("r.toml").write_text(draft_profile(ASSETS / f"{name}.xml", "r", Path("r.toml")).text)
        robots[name] = load_robot("r.toml")
        assert load_robot("r.toml") is robots[name]
    assert len(robots["dancer"].joint_names) == 28 and len(robots["g1"].joint_names) == 29
    Path("r.toml").write_text(draft_profile(ASSETS / "dancer.xml", "r", Path("r.toml")).text)
    assert len(load_robot("r.toml").joint_names) == 28


def test_the_command_does_not_write_over_a_profile(tmp_path, capsys, monkeypatch):
    from cli.robot import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / "dancer.toml").write_text("mine")
    assert main(["add", str(ASSETS / "dancer.xml")]) == 2
    assert "there already" in capsys.readouterr().err
    assert (tmp_path / "dancer.toml").read_text() == "mine"


def test_the_command_lists_the_robots(capsys):
    from cli.robot import main

    assert main(["list"]) == 0
    said = capsys.readouterr().out
    assert "dancer" in said and "Unitree G1" in said
