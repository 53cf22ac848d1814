"""Guessed gains carry the weight they were guessed from; guessed poses stand level, whichever way the axes point."""

import mujoco
import numpy as np
import pytest
from any_pose import dancer_xml

from robot_models.draft.estimates import doubted_ranges, estimate_pose, estimate_servos
from robot_models.draft.stance import _open
from robot_models.incoming import motor_efforts
from robot_models.rigid_body.pinocchio_model import urdf_text

HEIGHT = 0.7
SOLES = dict.fromkeys(("left", "right"), (-0.08, 0.14))
FLIPPED_KNEE = ('name="left_knee" axis="0 1 0" range="-0.05 2.5"', 'name="left_knee" axis="0 -1 0" range="-2.5 0.05"')


def unprofiled(folder, *changes):
    path = folder / "r.xml"
    path.write_text(dancer_xml(*changes))
    return _open(path), path


def heavier(folder, factor):
    spec = mujoco.MjSpec.from_string(dancer_xml())
    for geom in spec.geoms:
        geom.mass *= factor
    for body in spec.bodies:
        body.mass *= factor
    (folder / "r.xml").write_text(spec.to_xml())
    return _open(folder / "r.xml"), folder / "r.xml"


def test_gains_grow_with_the_weight(tmp_path):
    once, twice = (
        estimate_servos(s, HEIGHT, p).tables["kp"] for s, p in (heavier(tmp_path, 1.0), heavier(tmp_path, 2.0))
    )
    floor = min(once.values())
    carrying = [n for n in once if once[n] > floor]
    assert {"left_knee", "right_hip_pitch", "waist_roll", "left_shoulder_pitch"} <= set(carrying)
    for name in carrying:
        assert twice[name] / once[name] == pytest.approx(2.0, rel=0.1)  # both are written with two digits


def test_a_leg_carries_the_robot_and_an_arm_itself(tmp_path):
    robot, path = unprofiled(tmp_path)
    low, high = (estimate_servos(robot, h, path).tables["kp"] for h in (0.5, 1.0))
    for name in robot.joints:
        leg = any(p in name for p in ("hip", "knee", "ankle"))
        assert high[name] / low[name] == pytest.approx(2.0 if leg else 1.0, rel=0.1)
    # The robot leans by a small angle: gravity's torque is m g h per radian, which the gain must exceed.
    mass = robot.model.body_subtreemass[1]
    assert high["left_ankle_pitch"] > mass * 9.81 * 1.0


def test_left_and_right_are_guessed_alike_and_damping_is_a_time_times_stiffness(tmp_path):
    robot, path = unprofiled(tmp_path)
    tables = estimate_servos(robot, HEIGHT, path).tables
    for table in tables.values():
        assert list(table) == robot.joints
        for name in (n for n in table if n.startswith("left_")):
            assert table[name] == pytest.approx(table[name.replace("left", "right")])
    assert np.ptp([tables["kd"][n] / tables["kp"][n] for n in robot.joints]) < 1e-12


def test_what_the_file_says_is_taken_and_not_called_a_guess(tmp_path, dancer):
    path = tmp_path / "r.urdf"
    path.write_text(urdf_text(dancer))  # a URDF has efforts and speeds
    robot = _open(path)
    guess = estimate_servos(robot, HEIGHT, path)
    for name in robot.joints:
        assert guess.tables["effort"][name] == dancer.effort[dancer.joint(name)]
        assert guess.tables["velocity"][name] == dancer.velocity[dancer.joint(name)]
    assert not {"effort", "velocity"} & guess.guessed and not any("none in the file" in n for n in guess.notes)
    bare = estimate_servos(*unprofiled(tmp_path)[:1], HEIGHT, tmp_path / "r.xml")
    assert {"effort", "velocity"} <= bare.guessed
    assert any(n.startswith("effort: none in the file for left_hip_yaw, ") for n in bare.notes)
    effort, kp = bare.tables["effort"], bare.tables["kp"]
    weight = 9.81 * float(dancer.model.body_subtreemass[1])
    for name in ("left_shoulder_pitch", "left_elbow", "left_wrist_yaw"):  # holds an arm out, as a third of kp does not
        assert effort[name] >= max(1.5 * kp[name], 0.027 * weight * HEIGHT)
    assert effort["left_knee"] == pytest.approx(0.3 * kp["left_knee"], rel=0.05)
    armed = unprofiled(
        tmp_path, ('name="left_knee" axis', 'armature="0.123" actuatorfrcrange="-77 77" name="left_knee" axis')
    )
    own = estimate_servos(armed[0], HEIGHT, armed[1])
    assert (own.tables["armature"]["left_knee"], own.tables["effort"]["left_knee"]) == (0.123, 77.0)
    assert own.tables["armature"]["right_knee"] != 0.123


@pytest.mark.parametrize("changes", [(), (FLIPPED_KNEE,)], ids=["y", "-y"])
def test_the_guessed_pose_has_level_feet_under_the_hips_and_knees_ahead(tmp_path, changes):
    robot, _ = unprofiled(tmp_path, *changes)
    angles = estimate_pose(robot, SOLES).tables["default_pose"]
    data = mujoco.MjData(robot.model)
    for name, angle in angles.items():
        low, high = robot.model.joint(name).range
        assert low <= angle <= high
        data.joint(name).qpos[0] = angle
    mujoco.mj_forward(robot.model, data)
    for side in ("left", "right"):
        hip, knee, foot = (data.body(robot.landmarks[f"{side}_{p}"]) for p in ("hip", "knee", "foot"))
        np.testing.assert_allclose(foot.xmat.reshape(3, 3), np.eye(3), atol=1e-12)
        assert knee.xpos[0] > max(hip.xpos[0], foot.xpos[0]) + 0.02  # bent ahead, as a person's
        assert abs(foot.xpos[0] - hip.xpos[0]) < 0.05
    assert 0.0 <= data.subtree_com[1][0] - foot.xpos[0] <= 0.03 + 1e-3  # between the ankle and the middle of its sole


def test_a_robot_whose_mass_is_behind_its_ankles_leans_until_it_is_not(tmp_path):
    """Two roads: what the pose says, and MuJoCo's centre of mass in it."""
    backpack = (
        '<site name="imu_torso"', '<geom type="sphere" size=".05" pos="-.25 0 .1" mass="12"/><site name="imu_torso"'
    )  # fmt: skip
    behind, _ = unprofiled(tmp_path, backpack)
    before, after = (mujoco.MjData(behind.model) for _ in range(2))
    mujoco.mj_forward(behind.model, before)
    foot = behind.limbs.legs["left"][-1]
    assert before.subtree_com[1][0] < before.body(foot).xpos[0] - 0.01  # the control
    guess = estimate_pose(behind, SOLES)
    for name, angle in guess.tables["default_pose"].items():
        after.joint(name).qpos[0] = angle
    mujoco.mj_forward(behind.model, after)
    assert after.subtree_com[1][0] > after.body(foot).xpos[0]
    np.testing.assert_allclose(after.body(foot).xmat.reshape(3, 3), np.eye(3), atol=1e-12)
    assert any("legs leant by" in note for note in guess.notes)


def test_torque_limits_that_stand_in_the_motors_alone_are_read(tmp_path):
    path = tmp_path / "m.xml"
    path.write_text(
        '<mujoco><worldbody><body name="a"><geom size=".1"/>'
        + "".join(f'<body name="b{k}"><joint name="j{k}" range="-90 90"/><geom size=".1"/></body>' for k in range(4))
        + '</body></worldbody><actuator><motor joint="j0" gear="106" ctrllimited="true" ctrlrange="-1 1"/>'
        '<motor joint="j1" gear="2" forcelimited="true" forcerange="-30 30"/>'
        '<position joint="j2" ctrllimited="true" ctrlrange="-2 2"/>'
        "</actuator></mujoco>"
    )
    found = motor_efforts(mujoco.MjModel.from_xml_path(str(path)))
    assert found == {"j0": 106.0, "j1": 60.0}  # a servo's control is an angle, and says nothing


def test_a_leg_that_does_not_pitch_stands_straight_and_says_so(tmp_path):
    robot, _ = unprofiled(tmp_path, ('name="left_ankle_pitch" axis="0 1 0"', 'name="left_ankle_pitch" axis="0 0 1"'))
    guess = estimate_pose(robot, SOLES)
    assert any("the left leg stands straight" in n for n in guess.notes)
    assert guess.tables["default_pose"]["left_knee"] == 0.0 < guess.tables["default_pose"]["right_knee"]


def test_a_default_pose_stays_inside_a_range_that_excludes_zero(tmp_path):
    robot, _ = unprofiled(tmp_path, ('name="left_elbow" axis="0 1 0" range="-2.5 0.05"',
                                   'name="left_elbow" axis="0 1 0" range="-2.5 -0.7"'))  # fmt: skip
    assert estimate_pose(robot, SOLES).tables["default_pose"]["left_elbow"] == -0.7


def test_a_flipped_axis_with_a_flipped_range_is_no_difference(tmp_path):
    assert doubted_ranges(unprofiled(tmp_path, FLIPPED_KNEE)[0]) == []
    half = (FLIPPED_KNEE[0], FLIPPED_KNEE[1].replace("-2.5 0.05", "-0.05 2.5"))  # negative control: the axis alone
    (doubt,) = doubted_ranges(unprofiled(tmp_path, half)[0])
    assert "left_knee's and right_knee's differ" in doubt
