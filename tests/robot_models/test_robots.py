"""Every robot in the catalogue: loads, steps, and agrees with MuJoCo and Pinocchio, two independent roads."""

import sys

import mujoco
import numpy as np
import pytest

from robot_models import (
    LANDMARKS,
    RobotError,
    body_states,
    forward_kinematics,
    installed,
    load_robot,
    robot_names,
    sole_corners,
)
from robot_models.geometry import lowest_point, self_collisions
from robot_models.maths import rotation as rot
from robot_models.profile import PROFILES, expand_patterns, read_profile

ROBOTS = [n for n in robot_names() if installed(n)]


def random_state(robot, rng, count=20):
    q = np.tile(robot.default_qpos, (count, 1))
    q[:, :3] = rng.normal(size=(count, 3))
    q[:, 3:7] = rot.normalise(rng.normal(size=(count, 4)))
    q[:, 7:] = rng.uniform(robot.lower, robot.upper, (count, robot.nq - 7))
    return q, rng.normal(size=(count, robot.model.nv))


def test_the_base_robots_are_there():
    assert {"dancer", "g1"} <= set(ROBOTS)


@pytest.mark.parametrize("name", ROBOTS)
def test_kinematics_and_velocities_agree_with_mujoco(name, rng):
    robot = load_robot(name)
    q, v = random_state(robot, rng)
    states, data = body_states(robot, q, v), mujoco.MjData(robot.model)
    for t in range(len(q)):
        data.qpos[:], data.qvel[:] = q[t], v[t]
        mujoco.mj_forward(robot.model, data)
        for i, body in enumerate(robot.body_ids):
            twist = np.zeros(6)
            mujoco.mj_objectVelocity(robot.model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
            np.testing.assert_allclose(states.pos[t, i], data.xpos[body], atol=1e-9)
            assert rot.angle_between(states.quat[t, i], np.array(data.xquat[body])) < 1e-7
            np.testing.assert_allclose(states.ang_vel[t, i], twist[:3], atol=1e-9)
            np.testing.assert_allclose(states.lin_vel[t, i], twist[3:], atol=1e-9)


@pytest.mark.skipif(sys.platform == "win32", reason="no Pinocchio wheels")
@pytest.mark.parametrize("name", ROBOTS)
def test_pinocchio_agrees_on_kinematics_mass_matrix_and_inverse_dynamics(name, rng):
    import pinocchio as pin

    from robot_models.rigid_body.pinocchio_model import pinocchio_model, pinocchio_q, pinocchio_v

    robot = load_robot(name)
    model = pinocchio_model(robot)
    assert tuple(model.names)[2:] == robot.joint_names
    data, theirs = mujoco.MjData(robot.model), model.createData()
    qs, vs = random_state(robot, rng, 5)
    for q, v in zip(qs, vs, strict=True):
        pq, pv = pinocchio_q(q), pinocchio_v(q, v)
        pin.framesForwardKinematics(model, theirs, pq)
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, 0.0
        mujoco.mj_forward(robot.model, data)
        for body, name_ in zip(robot.body_ids, robot.body_names, strict=True):
            placed = theirs.oMf[model.getFrameId(name_)]
            np.testing.assert_allclose(placed.translation, data.xpos[body], atol=1e-9)
            np.testing.assert_allclose(placed.rotation, data.xmat[body].reshape(3, 3), atol=1e-9)
        # Pinocchio's velocity is T times MuJoCo's: the root's linear part turned from the world into the body frame.
        turn = np.eye(model.nv)
        turn[:3, :3] = rot.to_matrix(q[3:7]).T
        mass = np.zeros((robot.model.nv, robot.model.nv))
        mujoco.mj_fullM(robot.model, data, mass)
        pin.crba(model, theirs, pq)
        ours = np.triu(theirs.M) + np.triu(theirs.M, 1).T
        np.testing.assert_allclose(turn.T @ ours @ turn, mass, atol=1e-9 * np.abs(mass).max())
        data.qacc[:] = 0.0
        # MuJoCo's bias force: the generalised force at zero acceleration of qvel. Its free joint's linear velocity is
        # the world's, so zero acceleration there is -w x v in Pinocchio's body frame.
        acceleration = np.zeros(model.nv)
        acceleration[:3] = -np.cross(pv[3:6], pv[:3])
        forces = pin.rnea(model, theirs, pq, pv, acceleration)
        np.testing.assert_allclose(turn.T @ forces, data.qfrc_bias, atol=1e-8)


@pytest.mark.skipif(sys.platform == "win32", reason="no placo wheels")
@pytest.mark.parametrize("name", ROBOTS)
def test_placo_reads_the_derived_urdf(name, rng):
    import placo

    from robot_models.rigid_body.pinocchio_model import urdf_link, urdf_text

    robot = load_robot(name)
    other = placo.RobotWrapper("", placo.Flags.ignore_collisions, urdf_text(robot))
    # By name: Pinocchio sorts the children of a URDF by the alphabet.
    assert set(other.joint_names()) == set(robot.joint_names)
    q, _ = random_state(robot, rng, 1)
    q[0, :7] = [0, 0, 0, 1, 0, 0, 0]
    for joint, value in zip(robot.joint_names, q[0, 7:], strict=True):
        other.set_joint(joint, value)
    other.set_T_world_frame(urdf_link(robot, robot.body_names[0]), np.eye(4))
    other.update_kinematics()
    pos, _ = forward_kinematics(robot, q)
    for i, body in enumerate(robot.body_names):
        np.testing.assert_allclose(other.get_T_world_frame(urdf_link(robot, body))[:3, 3], pos[0, i], atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_default_pose_stands_on_its_soles_and_touches_nothing_else(name):
    robot = load_robot(name)
    pos, quat = forward_kinematics(robot, robot.default_qpos[None])
    corners = sole_corners(robot, pos, quat)
    assert np.abs(corners[..., 2]).max() < 2e-3  # both soles flat
    assert abs(lowest_point(robot, pos, quat)[0]) < 2e-3
    assert self_collisions(robot, robot.default_qpos[None]).depth[0] == 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_tables_are_complete(name):
    robot = load_robot(name)
    assert set(robot.profile.landmarks) == set(LANDMARKS)
    for array in (robot.lower, robot.upper, robot.velocity, robot.effort, robot.kp, robot.kd):
        assert np.isfinite(array).all()
    assert (robot.upper > robot.lower).all()
    assert min(robot.velocity.min(), robot.effort.min(), robot.kp.min()) > 0
    for joint in robot.joint_names:  # actuators in joint order, or ctrl[i] would move another joint
        assert robot.model.actuator(joint).id == robot.joint(joint)


@pytest.mark.parametrize("name", ROBOTS)
def test_it_steps_without_exploding(name):
    robot = load_robot(name)
    data = mujoco.MjData(robot.model)
    data.qpos[:] = robot.default_qpos
    for _ in range(100):
        data.ctrl[:] = robot.default_joint_pos
        mujoco.mj_step(robot.model, data)
    assert np.isfinite(data.qpos).all()
    assert data.qpos[2] > 0.8 * robot.default_qpos[2]


def test_g1_agrees_with_the_makers_urdf(rng):
    pytest.importorskip("pinocchio")
    import pinocchio as pin

    from robot_models.model_file import locate
    from robot_models.rigid_body.pinocchio_model import pinocchio_q

    robot = load_robot("g1")
    path = locate(robot.profile.meshes, robot.profile.folder)
    if path is None:
        pytest.skip("example-robot-data is not installed")
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    data = model.createData()
    assert sum(i.mass for i in model.inertias) == pytest.approx(robot.model.body_mass.sum(), abs=1e-9)
    q, _ = random_state(robot, rng)
    pos, _ = forward_kinematics(robot, q)
    for t in range(len(q)):
        theirs = pin.neutral(model)
        theirs[:7] = pinocchio_q(q[t])[:7]
        for joint, value in zip(robot.joint_names, q[t, 7:], strict=True):
            theirs[model.joints[model.getJointId(joint)].idx_q] = value
        pin.framesForwardKinematics(model, data, theirs)
        for i, body in enumerate(robot.body_names):
            np.testing.assert_allclose(data.oMf[model.getFrameId(body)].translation, pos[t, i], atol=1e-9)


def test_meshes_of_g1_hang_on_its_bodies():
    from robot_models.model_file import locate
    from robot_models.visual import visual_parts

    robot = load_robot("g1")
    if locate(robot.profile.meshes, robot.profile.folder) is None:
        pytest.skip("example-robot-data is not installed")
    parts = visual_parts(robot)
    assert {p.kind for p in parts} == {"mesh"}
    assert {p.body for p in parts} <= set(robot.body_names)
    # The head is behind a fixed joint: its mesh has to come out above the torso.
    assert max(p.vertices[:, 2].max() for p in parts if p.body == "torso_link") > 0.4


def test_training_models_carry_no_meshes():
    for name in ROBOTS:
        assert load_robot(name).model.nmesh == 0


def test_unknown_names_are_refused_with_the_nearest():
    robot = load_robot("dancer")
    with pytest.raises(RobotError, match="left_knee"):
        robot.joint("left_kne")
    with pytest.raises(RobotError, match="did you mean 'dancer'"):
        load_robot("dancr")


def test_a_pattern_that_matches_nothing_is_an_error():
    with pytest.raises(RobotError, match="no such joint"):
        expand_patterns({"left_hand": 1.0}, ["left_knee"], where="kp")
    with pytest.raises(RobotError, match="no value for right_knee"):
        expand_patterns({"left_.*": 1.0}, ["left_knee", "right_knee"], where="kp")


def test_hashes_tell_robots_apart_and_do_not_change_between_loads():
    from robot_models.build import build_robot

    hashes = {n: load_robot(n).hash for n in ROBOTS}
    assert len(set(hashes.values())) == len(ROBOTS)
    assert build_robot(read_profile(PROFILES / "dancer.toml")).hash == hashes["dancer"]


def test_a_robot_by_path_is_the_same_robot(tmp_path):
    text = (PROFILES / "dancer.toml").read_text().replace("../assets/dancer.xml", "dancer.xml")
    (tmp_path / "mine.toml").write_text(text)
    (tmp_path / "dancer.xml").write_text((PROFILES.parent / "assets" / "dancer.xml").read_text())
    assert load_robot(str(tmp_path / "mine.toml")).hash == load_robot("dancer").hash


def test_a_profile_that_names_a_missing_body_is_refused(tmp_path):
    text = (PROFILES / "dancer.toml").read_text().replace("../assets/dancer.xml", "dancer.xml")
    (tmp_path / "mine.toml").write_text(text.replace('left_wrist = "left_wrist_yaw_link"', 'left_wrist = "left_hand"'))
    (tmp_path / "dancer.xml").write_text((PROFILES.parent / "assets" / "dancer.xml").read_text())
    with pytest.raises(RobotError, match="left_hand"):
        load_robot(str(tmp_path / "mine.toml"))


SCENE = """
<mujoco><compiler angle="radian"/>
<asset><mesh name="hip" file="absent.stl"/>
<texture name="sky" type="skybox" builtin="gradient" width="8" height="8"/></asset>
<worldbody><geom name="floor" type="plane" size="1 1 1"/>{body}</worldbody>
<sensor><framepos name="gyro" objtype="body" objname="pelvis"/></sensor>
<keyframe><key name="home" qpos="{qpos}"/></keyframe></mujoco>
"""


def test_an_mjcf_scene_with_absent_meshes_a_floor_and_key_frames_is_read(tmp_path):
    import xml.etree.ElementTree as ET

    tree = ET.parse(PROFILES.parent / "assets" / "dancer.xml").getroot()
    body = tree.find("worldbody/body")
    body.set("pos", "0 0 0.8")
    body.remove(body.find("freejoint"))
    ET.SubElement(body, "joint", {"name": "floating_base", "type": "free"})
    for geom in body.iter("geom"):
        geom.attrib.pop("class")
    ET.SubElement(body, "geom", {"type": "mesh", "mesh": "hip", "mass": "0"})
    qpos = " ".join(["0"] * 35)
    (tmp_path / "scene.xml").write_text(SCENE.format(body=ET.tostring(body, encoding="unicode"), qpos=qpos))
    profile = (PROFILES / "dancer.toml").read_text().replace("../assets/dancer.xml", "scene.xml")
    (tmp_path / "scene.toml").write_text(profile)
    robot = load_robot(str(tmp_path / "scene.xml"))
    assert robot.hash == load_robot("dancer").hash
    assert robot.default_qpos[2] == pytest.approx(load_robot("dancer").default_qpos[2])


def test_a_missing_package_is_refused_with_the_command_that_brings_it(tmp_path):
    text = (PROFILES / "jvrc1.toml").read_text().replace("jvrc_description", "no_such_package")
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(RobotError, match="pip install"):
        load_robot(str(tmp_path / "mine.toml"))


@pytest.mark.parametrize("name", ROBOTS)
def test_jacobians_are_the_derivatives_of_the_poses(name, rng):
    from robot_models.rigid_body.jacobians import forces, integrate, kinematics

    robot = load_robot(name)
    q, _ = random_state(robot, rng, 3)
    q = np.repeat(q[:1], robot.model.nv, axis=0)
    small = 1e-6 * np.eye(robot.model.nv)
    before, after = kinematics(robot, integrate(q, -small)), kinematics(robot, integrate(q, small))
    here = kinematics(robot, q[:1])
    for body in (0, robot.landmark("left_foot"), robot.landmark("right_wrist")):
        point = (after.pos[:, body] - before.pos[:, body]) / 2e-6
        turn = rot.log(rot.multiply(after.quat[:, body], rot.conjugate(before.quat[:, body]))) / 2e-6
        bodies = np.repeat(body, 3)
        np.testing.assert_allclose(here.derivatives(bodies, forces(here.pos[:, body]))[0].T, point, atol=1e-7)
        np.testing.assert_allclose(here.derivatives(bodies, np.eye(3, 6)[None])[0].T, turn, atol=1e-7)
