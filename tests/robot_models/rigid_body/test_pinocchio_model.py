"""Pinocchio's robot where a tree is awkward, and its two conventions: scalar last, root velocity in the body frame."""

import mujoco
import numpy as np
import pytest
from any_pose import awkward, posed, random_qpos

from robot_models import RobotError
from robot_models.maths import rotation as rot
from robot_models.rigid_body.pinocchio_model import pinocchio_model, pinocchio_q, pinocchio_v, urdf_text

pin = pytest.importorskip("pinocchio")


def test_hinges_off_their_bodies_origins_and_fixed_bodies_come_over(tmp_path, rng):
    robot = awkward(tmp_path)
    model = pinocchio_model(robot)
    data = model.createData()
    for q in random_qpos(robot, rng, 4):
        theirs = posed(robot, q)
        pin.framesForwardKinematics(model, data, pinocchio_q(q))
        for body in range(1, robot.model.nbody):
            frame = data.oMf[model.getFrameId(robot.model.body(body).name)]
            np.testing.assert_allclose(frame.translation, theirs.xpos[body], atol=1e-12)
            np.testing.assert_allclose(frame.rotation.ravel(), theirs.xmat[body], atol=1e-12)


def test_weights_and_their_places_come_over(tmp_path, rng):
    robot = awkward(tmp_path)
    model = pinocchio_model(robot)
    data = model.createData()
    assert pin.computeTotalMass(model) == pytest.approx(robot.model.body_mass.sum(), abs=1e-12)
    for q in random_qpos(robot, rng, 4):
        centre = pin.centerOfMass(model, data, pinocchio_q(q))
        np.testing.assert_allclose(centre, posed(robot, q).subtree_com[0], atol=1e-12)
        kinetic = pin.computeKineticEnergy(model, data, pinocchio_q(q), np.eye(model.nv)[0])
        assert kinetic == pytest.approx(0.5 * robot.model.body_mass.sum())  # one metre per second along the root's x


def test_limits_and_rotors_stand_at_the_joints_they_belong_to(dancer):
    model = pinocchio_model(dancer)
    for name in dancer.joint_names:
        joint, j = model.joints[model.getJointId(name)], dancer.joint(name)
        assert (joint.idx_q, joint.idx_v) == (7 + j, 6 + j)
        assert model.lowerPositionLimit[joint.idx_q] == dancer.lower[j]
        assert model.upperPositionLimit[joint.idx_q] == dancer.upper[j]
        assert model.velocityLimit[joint.idx_v] == dancer.velocity[j]
        assert model.armature[joint.idx_v] == dancer.model.dof_armature[6 + j] > 0.0
    np.testing.assert_array_equal(model.armature[:6], 0.0)


def test_configurations_change_the_order_of_the_root_quaternion_and_of_nothing_else():
    qpos = np.arange(36.0)
    q = pinocchio_q(qpos)
    np.testing.assert_array_equal(q[3:7], [4, 5, 6, 3])
    np.testing.assert_array_equal(np.delete(q, range(3, 7)), np.delete(qpos, range(3, 7)))
    stack = np.stack((qpos, qpos + 100)).reshape(2, 1, 36)
    np.testing.assert_array_equal(pinocchio_q(stack)[:, 0], [q, q + 100])
    np.testing.assert_array_equal(qpos, np.arange(36.0))  # the caller's array stays


def test_a_root_that_flies_straight_or_spins_in_place_goes_on_alike_in_both(dancer, rng):
    model = pinocchio_model(dancer)
    for part in (slice(0, 3), slice(3, 6)):  # both at once would be a screw for one and not for the other
        (q,), v = random_qpos(dancer, rng, 1), np.zeros(dancer.model.nv)
        v[part] = rng.normal(size=3)
        v[6:] = rng.normal(size=dancer.model.nu)
        theirs = pin.integrate(model, pinocchio_q(q), pinocchio_v(q, v))
        mujoco.mj_integratePos(dancer.model, q, v, 1.0)
        np.testing.assert_allclose(theirs[:3], q[:3], atol=1e-12)
        assert rot.angle_between(rot.from_quat_xyzw(theirs[3:7]), q[3:7]) < 1e-7
        np.testing.assert_allclose(theirs[7:], q[7:], atol=1e-12)


def test_the_roots_speed_does_not_depend_on_the_frame_but_its_direction_does(dancer, rng):
    q, v = random_qpos(dancer, rng, 8), rng.normal(size=(8, dancer.model.nv))
    local = pinocchio_v(q, v)
    np.testing.assert_allclose(np.linalg.norm(local[:, :3], axis=1), np.linalg.norm(v[:, :3], axis=1), atol=1e-12)
    np.testing.assert_allclose(rot.rotate(q[:, 3:7], local[:, :3]), v[:, :3], atol=1e-12)
    np.testing.assert_array_equal(local[:, 3:], v[:, 3:])
    assert np.abs(local[:, :3] - v[:, :3]).max() > 0.1  # negative control


def test_mujoco_reads_the_derived_urdf_as_the_same_robot(dancer, rng):
    again = mujoco.MjModel.from_xml_string(urdf_text(dancer))  # on a fixed root, siblings in another order
    data = mujoco.MjData(again)
    q = random_qpos(dancer, rng, 1)[0]
    q[:7] = [0, 0, 0, 1, 0, 0, 0]
    for name, angle in zip(dancer.joint_names, q[7:], strict=True):
        data.joint(name).qpos[0] = angle
    mujoco.mj_forward(again, data)
    ours = posed(dancer, q)
    for body in dancer.body_names[1:]:
        np.testing.assert_allclose(data.body(body).xpos, ours.body(body).xpos, atol=1e-12)
        np.testing.assert_allclose(data.body(body).xmat, ours.body(body).xmat, atol=1e-12)
        assert again.body(body).mass[0] == pytest.approx(dancer.model.body(body).mass[0], abs=1e-12)
        # Principal moments are sorted by MuJoCo.
        a, b = (np.sort(m.body(body).inertia) for m in (again, dancer.model))
        np.testing.assert_allclose(a, b, rtol=1e-9)
    for name in dancer.joint_names:
        np.testing.assert_array_equal(again.joint(name).range, dancer.model.joint(name).range)


def test_an_axis_that_misses_its_body_cannot_be_said_in_a_urdf(tmp_path):
    with pytest.raises(RobotError, match="joint 'left_knee'.*pass through its body's origin|joint 'waist_yaw'.*origin"):
        urdf_text(awkward(tmp_path))
