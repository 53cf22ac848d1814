"""Forward kinematics on trees that no built-in robot has, and what must not change it: where the world's origin is."""

import numpy as np
import pytest
from any_pose import awkward, posed, random_qpos

from robot_models import CONTACT_NAMES, body_states, forward_kinematics, heel_toe_positions, sole_corners
from robot_models.build import CONTACT_RADIUS
from robot_models.maths import rotation as rot
from robot_models.rigid_body.kinematics import joint_axes

# Chains of a dozen rotations of numbers near one: some hundred roundings of 1e-16.
EXACT = 1e-12


@pytest.fixture
def strange(tmp_path):
    return awkward(tmp_path)


def test_hinges_off_their_bodies_origins_and_fixed_bodies_between_are_followed(strange, rng):
    assert strange.model.nbody == len(strange.body_names) + 2  # the world and the spacer
    q = random_qpos(strange, rng, 6)
    pos, quat = forward_kinematics(strange, q)
    for t in range(len(q)):
        data = posed(strange, q[t])
        np.testing.assert_allclose(pos[t], data.xpos[list(strange.body_ids)], atol=EXACT)
        turned = rot.to_matrix(quat[t]).reshape(-1, 9)
        np.testing.assert_allclose(turned, data.xmat[list(strange.body_ids)], atol=EXACT)


def test_axes_and_anchors_are_mujocos_joint_by_joint(strange, rng):
    q = random_qpos(strange, rng, 4)
    _, _, axes, anchors = joint_axes(strange, q)
    ids = [strange.model.joint(n).id for n in strange.joint_names]
    for t in range(len(q)):
        data = posed(strange, q[t])
        np.testing.assert_allclose(axes[t], data.xaxis[ids], atol=EXACT)
        np.testing.assert_allclose(anchors[t], data.xanchor[ids], atol=EXACT)


def test_velocities_are_the_rates_at_which_poses_change_under_mujocos_integration(strange, rng):
    import mujoco

    q, v, h = random_qpos(strange, rng, 4), rng.normal(size=(4, strange.model.nv)), 1e-5
    states = body_states(strange, q, v)
    ahead, behind = q.copy(), q.copy()
    for t in range(len(q)):
        mujoco.mj_integratePos(strange.model, ahead[t], v[t], h)
        mujoco.mj_integratePos(strange.model, behind[t], v[t], -h)
    (p1, r1), (p0, r0) = forward_kinematics(strange, ahead), forward_kinematics(strange, behind)
    # Central differences: h^2 times a third derivative of up to some hundred, and 1e-16 / h of rounding.
    np.testing.assert_allclose(states.lin_vel, (p1 - p0) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(states.ang_vel, rot.log(rot.multiply(r1, rot.conjugate(r0))) / (2 * h), atol=1e-6)


def test_moving_the_root_moves_every_body_alike(dancer, rng):
    q = random_qpos(dancer, rng, 5)
    turn, shift = rot.normalise(rng.normal(size=4)), rng.normal(size=3)
    moved = q.copy()
    moved[:, :3] = rot.rotate(np.tile(turn, (5, 1)), q[:, :3]) + shift
    moved[:, 3:7] = rot.multiply(np.tile(turn, (5, 1)), q[:, 3:7])
    (pos, quat), (pos_m, quat_m) = forward_kinematics(dancer, q), forward_kinematics(dancer, moved)
    everywhere = np.broadcast_to(turn, quat.shape)
    np.testing.assert_allclose(pos_m, rot.rotate(everywhere, pos) + shift, atol=EXACT)
    assert rot.angle_between(quat_m, rot.multiply(everywhere, quat)).max() < 1e-7  # of an arc cosine near one


def test_sign_and_length_of_the_root_quaternion_do_not_matter_but_its_order_does(dancer, rng):
    q = random_qpos(dancer, rng, 5)
    longer, other = q.copy(), q.copy()
    longer[:, 3:7] *= np.array([-1.0, 2.0, -0.5, 1.5, 3.0])[:, None]
    other[:, 3:7] = rot.to_quat_xyzw(q[:, 3:7])
    (pos, quat), (pos_l, quat_l) = forward_kinematics(dancer, q), forward_kinematics(dancer, longer)
    np.testing.assert_allclose(pos_l, pos, atol=EXACT)
    assert rot.angle_between(quat_l, quat).max() < 1e-7
    assert np.abs(forward_kinematics(dancer, other)[0] - pos).max() > 0.1  # negative control


@pytest.mark.parametrize("joint", ["left_hip_yaw", "waist_yaw", "right_elbow"])
def test_a_joint_moves_what_hangs_from_it_and_nothing_else(dancer, rng, joint):
    q = np.repeat(random_qpos(dancer, rng, 1), 2, axis=0)
    q[1, 7 + dancer.joint(joint)] += 0.3
    _, quat = forward_kinematics(dancer, q)
    turned = rot.angle_between(quat[0], quat[1])
    hangs = np.zeros(len(dancer.body_names), dtype=bool)
    for i, body in enumerate(dancer.body_ids):
        while body and dancer.model.body_jntadr[body] != dancer.model.joint(joint).id:
            body = int(dancer.model.body_parentid[body])
        hangs[i] = body > 0
    np.testing.assert_allclose(turned, np.where(hangs, 0.3, 0.0), atol=1e-7)


def test_orientations_are_continuous_through_a_whole_turn(dancer):
    q = np.tile(dancer.default_qpos, (50, 1))
    q[:, 3:7] = rot.from_yaw(np.linspace(0.0, 2 * np.pi, 50))
    q[25:, 3:7] *= -1.0
    _, quat = forward_kinematics(dancer, q)
    assert (np.sum(quat[1:] * quat[:-1], axis=-1) > 0.9).all()


def test_corners_lie_under_the_contact_points_of_the_physics(dancer, rng):
    q = random_qpos(dancer, rng, 3)
    corners = sole_corners(dancer, *forward_kinematics(dancer, q))
    for t in range(len(q)):
        data = posed(dancer, q[t])
        for f, side in enumerate(("left", "right")):
            up = data.body(dancer.soles[side].body).xmat.reshape(3, 3)[:, 2]
            spheres = np.array([data.geom(f"{side}_sole_{i}").xpos for i in range(4)])
            np.testing.assert_allclose(corners[t, f], spheres - CONTACT_RADIUS * up, atol=EXACT)


def test_edges_are_named_as_contacts_are_heel_before_toe_left_before_right(dancer):
    q = dancer.default_qpos[None].copy()
    edges = dict(zip(CONTACT_NAMES, heel_toe_positions(dancer, *forward_kinematics(dancer, q))[0], strict=True))
    for side, sign in (("left", 1.0), ("right", -1.0)):  # the dancer faces +x: its left is +y
        heel, toe = edges[f"{side}_heel"], edges[f"{side}_toe"]
        assert toe[0] > heel[0] and sign * heel[1] > 0 and sign * toe[1] > 0
        sole = dancer.soles[side]
        assert np.linalg.norm(toe - heel) == pytest.approx(sole.x[1] - sole.x[0], abs=EXACT)
