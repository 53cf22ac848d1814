"""What a robot tells of itself: ranges, inertia, places, and a hash of its kinematics and of nothing else."""

import mujoco
import numpy as np
import pytest
from any_pose import awkward, dancer_xml, posed, profiled, random_qpos

from robot_models import RobotError, forward_kinematics, leg_length, load_robot


@pytest.mark.parametrize("margin", [0.0, 0.02, 0.5, 10.0])
def test_ranges_keep_their_margin_but_never_lose_more_than_a_tenth_on_either_side(dancer, margin):
    low, high = dancer.ranges(margin)
    width = dancer.upper - dancer.lower
    inside = np.minimum(low - dancer.lower, dancer.upper - high)
    np.testing.assert_allclose(low - dancer.lower, dancer.upper - high, atol=1e-12)  # alike at both ends
    assert (high > low).all() and (inside <= 0.1 * width + 1e-12).all() and (inside <= margin + 1e-12).all()
    assert (np.isclose(inside, margin) | np.isclose(inside, 0.1 * width)).all()


def test_acceleration_is_what_inverse_dynamics_asks_of_one_joint_alone(dancer):
    """A second road to the diagonal: the torque of an acceleration of one joint while all others are held at none."""
    model, data = dancer.model, posed(dancer, dancer.default_qpos)
    data.qvel[:] = 0.0
    still, moving = np.zeros(model.nv), np.zeros(model.nv)
    data.qacc[:] = 0.0
    mujoco.mj_rne(model, data, 1, still)
    for j in range(model.nu):
        data.qacc[:] = 0.0
        data.qacc[6 + j] = 1.0
        mujoco.mj_rne(model, data, 1, moving)
        inertia = moving[6 + j] - still[6 + j] + model.dof_armature[6 + j]  # rne knows no rotors
        assert dancer.acceleration[j] == pytest.approx(min(0.8 * dancer.effort[j] / inertia, 400.0), rel=1e-9)
    assert dancer.acceleration.max() <= 400.0 < (0.8 * dancer.effort / model.dof_armature[6:]).max()


def test_fixed_bodies_have_the_place_of_the_body_that_carries_them(tmp_path, rng):
    robot = awkward(tmp_path)
    m, places = robot.model, robot.place_of_body
    spacer = m.body("spacer").id
    assert places[0] == -1 and places[spacer] == robot.body("left_shoulder_yaw_link")
    np.testing.assert_array_equal(places[list(robot.body_ids)], np.arange(len(robot.body_ids)))
    # What is fixed keeps its distance to its carrier at any pose.
    gaps = [np.linalg.norm(d.xpos[spacer] - d.xpos[robot.body_ids[places[spacer]]])
            for d in (posed(robot, q) for q in random_qpos(robot, rng, 3))]  # fmt: skip
    np.testing.assert_allclose(gaps, gaps[0], atol=1e-12)


def test_leg_length_is_that_of_the_bones_at_any_pose(dancer, rng):
    pos, _ = forward_kinematics(dancer, random_qpos(dancer, rng, 4))
    legs = []
    for side in ("left", "right"):
        hip, knee, foot = (pos[:, dancer.landmark(f"{side}_{p}")] for p in ("hip", "knee", "foot"))
        legs.append(np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(foot - knee, axis=1))
    np.testing.assert_allclose(legs, leg_length(dancer), atol=1e-12)


@pytest.mark.parametrize(
    "change",
    [
        ('<body name="left_knee_link" pos="0 0 -0.33">', '<body name="left_knee_link" pos="0 0 -0.331">'),
        ('name="left_knee" axis="0 1 0"', 'name="left_knee" axis="0 -1 0"'),
        ('<body name="right_elbow_link" pos="0 0 -0.24">', '<body name="right_elbow_link" pos="0 0 -0.24" quat="1 0.01 0 0">'),
        ('name="left_elbow" axis="0 1 0" range="-2.5 0.05"', 'name="left_elbow" axis="0 1 0" range="-2.4 0.05"'),
        ('name="right_hip_yaw" axis="0 0 1"', 'name="right_hip_yaw" pos="0 0 0.01" axis="0 0 1"'),
    ],
    ids=["length", "axis", "turn", "range", "anchor"],
)  # fmt: skip
def test_a_change_of_the_kinematics_is_another_hash(tmp_path, dancer, change):
    assert load_robot(profiled(tmp_path, dancer_xml(change))).hash != dancer.hash


@pytest.mark.parametrize(
    ("xml", "profile"),
    [
        ([('mass="4.2"', 'mass="5.0"')], []),
        ([('rgba="0.95 0.55 0.15 1"', 'rgba="0 0 1 1"')], []),
        ([], [('".*" = 100.0\n".*_(hip', '".*" = 90.0\n".*_(hip')]),
        ([], [("friction = 0.9", "friction = 0.4")]),
    ],
    ids=["mass", "colour", "gains", "friction"],
)
def test_what_moves_no_body_is_no_other_hash(tmp_path, dancer, xml, profile):
    assert load_robot(profiled(tmp_path, dancer_xml(*xml), *profile)).hash == dancer.hash


def test_arrays_and_names_say_the_same_places(dancer):
    for i, name in enumerate(dancer.joint_names):
        assert dancer.joint(name) == i and int(dancer.model.joint(name).qposadr[0]) == 7 + i
        # Body i + 1 is the one that joint i moves.
        assert dancer.body_ids[i + 1] == int(dancer.model.jnt_bodyid[dancer.model.joint(name).id])
    for i, name in enumerate(dancer.body_names):
        assert dancer.body(name) == i and dancer.model.body(name).id == dancer.body_ids[i]
    assert dancer.nq == 7 + len(dancer.joint_names) == len(dancer.zero_qpos)


@pytest.mark.parametrize("name", ["lower", "upper", "velocity", "effort", "kp", "kd", "default_qpos"])
def test_tables_of_a_loaded_robot_cannot_be_changed(dancer, name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(dancer, name)[0] = 1.0


def test_a_body_is_not_a_joint(dancer):
    with pytest.raises(RobotError, match=r"joint 'pelvis': found no such name"):
        dancer.joint("pelvis")
    with pytest.raises(RobotError, match=r"body 'left_knee'.*left_knee_link"):
        dancer.body("left_knee")
