"""A compiled robot does what its tables say: servos, soles and gyro; a profile that does not fit is refused."""

import mujoco
import numpy as np
import pytest
from any_pose import dancer_xml, posed, profiled, random_qpos

from robot_models import RobotError, load_robot
from robot_models.build import BODY_BIT, FLOOR_BIT
from robot_models.maths import rotation as rot


def test_servos_push_by_their_gains_and_no_harder_than_their_effort(dancer, rng):
    pushes = []
    for q in random_qpos(dancer, rng, 6):
        v = rng.normal(size=dancer.model.nv)
        data = posed(dancer, q, v)
        data.ctrl[:] = q[7:] + rng.normal(scale=0.6, size=dancer.model.nu)
        mujoco.mj_forward(dancer.model, data)
        wanted = dancer.kp * (data.ctrl - q[7:]) - dancer.kd * v[6:]
        np.testing.assert_allclose(data.actuator_force, np.clip(wanted, -dancer.effort, dancer.effort), atol=1e-9)
        pushes.append(np.abs(wanted) > dancer.effort)
    assert 0.1 < np.mean(pushes) < 0.9  # both kinds were among them


def test_a_standing_robot_touches_the_floor_with_its_contact_points_and_nothing_else(dancer):
    m, sunk = dancer.model, dancer.default_qpos.copy()
    sunk[2] -= 1e-3
    pairs = {tuple(sorted(m.geom(int(g)).name for g in c.geom)) for c in posed(dancer, sunk).contact}
    points = [f"{s}_sole_{i}" for s, sole in dancer.soles.items() for i in range(len(sole.points))]
    assert pairs == {("floor", p) for p in points}
    for geom in range(m.ngeom):  # the robot's own surface never touches the floor: the points stand for it
        own = bool(m.geom_contype[geom] & BODY_BIT)
        assert not (own and m.geom_conaffinity[geom] & FLOOR_BIT)


def test_dressing_a_robot_adds_no_weight(dancer):
    plain = mujoco.MjModel.from_xml_string(dancer_xml())
    assert dancer.model.body_mass.sum() == pytest.approx(plain.body_mass.sum(), abs=1e-12)
    np.testing.assert_allclose(dancer.model.body_inertia, plain.body_inertia, atol=1e-12)


def test_the_gyro_tells_the_roots_spin_in_its_own_frame(dancer, rng):
    for q in random_qpos(dancer, rng, 3):
        v = rng.normal(size=dancer.model.nv)
        data = posed(dancer, q, v)
        np.testing.assert_allclose(data.sensor("gyro").data, v[3:6], atol=1e-12)
        in_the_world = rot.rotate(q[3:7], v[3:6])
        assert np.abs(data.sensor("gyro").data - in_the_world).max() > 0.01  # negative control


def test_files_own_servos_sensors_and_keys_are_replaced(tmp_path, dancer):
    extra = (
        '<actuator><motor joint="left_knee" gear="7"/></actuator><sensor><gyro name="gyro" site="imu_torso"/></sensor>'
        "</mujoco>"
    )
    robot = load_robot(profiled(tmp_path, dancer_xml(("</mujoco>", extra))))
    assert robot.model.nu == dancer.model.nu and robot.model.nsensor == 1
    assert robot.model.site(int(robot.model.sensor("gyro").objid[0])).name == "imu"


def test_capsules_are_added_where_the_profile_says_and_excluded_pairs_do_not_touch(tmp_path):
    capsule = (
        '[capsules.belt]\nbody = "pelvis"\nfrom = [0, -0.2, -0.4]\nto = [0, 0.2, -0.4]\nradius = 0.05\n\n[soles.left]'
    )
    robot = load_robot(profiled(tmp_path, dancer_xml(), ("[soles.left]", capsule)))
    data = posed(robot, robot.default_qpos)
    ends = data.geom("belt").xpos + np.outer([-0.2, 0.2], data.geom("belt").xmat.reshape(3, 3)[:, 2])
    expected = data.body("pelvis").xpos + [[0, -0.2, -0.4], [0, 0.2, -0.4]]
    np.testing.assert_allclose(ends[np.argsort(ends[:, 1])], expected, atol=1e-9)
    touched = {robot.model.body(int(robot.model.geom_bodyid[g])).name for c in data.contact for g in c.geom}
    assert "pelvis" in touched and "left_knee_link" in touched  # a bar through the legs
    free = ('excludes = [', 'excludes = [["pelvis", "left_knee_link"], ["right_knee_link", "pelvis"],')  # fmt: skip
    other = load_robot(profiled(tmp_path, dancer_xml(), ("[soles.left]", capsule), free))
    names = [{other.model.body(int(other.model.geom_bodyid[g])).name for g in c.geom}
             for c in posed(other, other.default_qpos).contact]  # fmt: skip
    assert not any({"pelvis", f"{s}_knee_link"} <= n for n in names for s in ("left", "right"))


@pytest.mark.parametrize(
    ("xml", "profile", "said"),
    [
        ([], [('".*" = 20.0\n".*_wrist_.*" = 25.0', '".*_wrist_.*" = 25.0')], r"velocity: found no limit for left_hip_yaw"),
        ([], [('[joints.effort]\n".*" = 100.0', '[joints.effort]\n".*_knee" = 100.0')], "effort: found no limit for left_hip"),
        ([], [('imu = "imu"', 'imu = "gyroscope"')], "no site 'gyroscope'"),
        ([], [('root = "pelvis"', 'root = "hips"')], "root: found 'pelvis' at the top of the tree, expected 'hips'"),
        ([], [('["pelvis", "waist_yaw_link"]', '["pelvis", "belly"]')], "excludes: found no body 'belly'"),
        ([], [('body = "left_ankle_roll_link"', 'body = "left_shoe"')], "left sole: found no body 'left_shoe'"),
        ([], [('".*_elbow" = -0.4', '".*_elbov" = -0.4')], r"default_pose pattern '\.\*_elbov'"),
        ([], [('anchor = "waist_yaw_link"', 'anchor = "waist"')], "body 'waist': found no such name"),
        ([('range="-0.05 2.5"', 'limited="false"')], [], "no position limit for left_knee, right_knee"),
        ([('name="left_knee" axis', 'name="left_knee" type="slide" axis'), ('<joint name="left_knee"',
          '<joint name="extra" type="ball"/><joint name="left_knee"')], [], "joints that are not hinges"),
    ],
    ids=["velocity", "effort", "imu", "root", "excludes", "sole", "pose", "anchor", "range", "ball"],
)  # fmt: skip
def test_a_profile_that_does_not_fit_its_model_file_is_refused(tmp_path, xml, profile, said):
    with pytest.raises(RobotError, match=said):
        load_robot(profiled(tmp_path, dancer_xml(*xml), *profile))
