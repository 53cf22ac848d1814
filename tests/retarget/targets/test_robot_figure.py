"""A robot's recording as a figure: its points are its bodies, its orientations those of someone upright."""

import numpy as np
import pytest
from derivatives import random_poses

from clips import RobotClip
from clips.clip import REQUIRED
from clips.provenance import Provenance
from retarget.targets.robot_figure import as_figure
from retarget.targets.segment_frames import foot_frames, trunk_frames
from robot_models import FEET, forward_kinematics, heel_toe_positions, load_robot
from robot_models.maths import rotation as rot


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


def recording(robot, qpos, joints=None):
    joints = robot.joint_names if joints is None else joints
    return RobotClip(
        fps=50.0, robot=robot.name, joint_names=tuple(joints), root_pos=qpos[:, :3], root_quat=qpos[:, 3:7],
        joint_pos=qpos[:, [7 + robot.joint(j) for j in joints]],
        source=Provenance(file="made", sha256="0" * 64, dialect="made"),
    )  # fmt: skip


def test_points_are_where_the_bodies_are_and_toes_where_the_soles_end(robot, rng):
    qpos = random_poses(robot, rng, 4)
    figure, (pos, quat) = as_figure(recording(robot, qpos)), forward_kinematics(robot, qpos)
    for landmark, body in (
        ("left_knee", "left_knee"),
        ("right_ankle", "right_foot"),
        ("chest", "torso"),
        ("pelvis", "pelvis"),
    ):
        np.testing.assert_allclose(figure.point(landmark), pos[:, robot.landmark(body)], atol=1e-12)
    edges = heel_toe_positions(robot, pos, quat)
    for k, side in enumerate(FEET):
        np.testing.assert_allclose(figure.point(f"{side}_toe"), edges[:, 2 * k + 1], atol=1e-9)
    assert set(REQUIRED) <= set(figure.landmarks) and figure.upright


def test_at_zero_every_orientation_is_identity_and_the_figure_faces_x(robot):
    figure = as_figure(recording(robot, np.tile(robot.zero_qpos, (3, 1))))
    assert rot.angle_between(figure.orientations, np.broadcast_to(rot.IDENTITY, figure.orientations.shape)).max() < 1e-7
    ahead = figure.point("left_toe") - figure.point("left_ankle")
    assert (ahead[:, 0] > 0.05).all() and np.abs(ahead[:, 1]).max() < 0.05
    assert (figure.point("left_hip") - figure.point("right_hip"))[0, 1] > 0.05


def test_frames_of_its_trunk_and_feet_are_its_bodies_turned_from_zero(robot, rng):
    """Two ways to one orientation: what the figure says of a body, and the turn that kinematics gives it."""
    qpos = random_poses(robot, rng, 5)
    figure = as_figure(recording(robot, qpos))
    (_, quat), (_, zero) = forward_kinematics(robot, qpos), forward_kinematics(robot, robot.zero_qpos[None])
    flat = np.ones(5, dtype=bool)
    frames = [*trunk_frames(figure), *(foot_frames(figure, s, flat) for s in FEET)]
    for frame, landmark in zip(frames, ("pelvis", "torso", "left_foot", "right_foot"), strict=True):
        body = robot.landmark(landmark)
        wanted = rot.multiply(quat[:, body], np.broadcast_to(rot.conjugate(zero[0, body]), (5, 4)))
        assert rot.angle_between(frame, wanted).max() < 1e-7


def test_parents_make_one_tree(robot):
    figure = as_figure(recording(robot, np.tile(robot.default_qpos, (3, 1))))
    roots = [k for k, p in enumerate(figure.parents) if p < 0]
    assert len(roots) == 1
    for k in range(len(figure.names)):
        seen = []
        while k >= 0:
            assert k not in seen
            seen.append(k)
            k = figure.parents[k]
        assert seen[-1] == roots[0]


def test_the_figure_moves_with_the_robot(robot, rng):
    qpos = random_poses(robot, rng, 4)
    turn, shift = rot.from_yaw(np.array(1.3)), np.array([1.0, -2.0, 0.5])
    moved = qpos.copy()
    moved[:, :3], moved[:, 3:7] = rot.rotate(turn, qpos[:, :3]) + shift, rot.multiply(turn[None], qpos[:, 3:7])
    here, there = as_figure(recording(robot, qpos)), as_figure(recording(robot, moved))
    np.testing.assert_allclose(there.positions, rot.rotate(turn, here.positions) + shift, atol=1e-9)
    turned = rot.multiply(np.broadcast_to(turn, here.orientations.shape), here.orientations)
    assert rot.angle_between(turned, there.orientations).max() < 1e-7


def test_joints_that_the_recording_lacks_stand_at_their_default(dancer):
    qpos = np.tile(dancer.default_qpos, (3, 1))
    some = [j for j in dancer.joint_names if "shoulder" not in j]
    np.testing.assert_allclose(
        as_figure(recording(dancer, qpos, some)).positions, as_figure(recording(dancer, qpos)).positions, atol=1e-12
    )
