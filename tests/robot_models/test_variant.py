"""Variants of a robot: fewer joints, the same body."""

import numpy as np
import pytest

from clips import ReadOptions, read_clip
from robot_models import RobotError, forward_kinematics, load_robot


@pytest.mark.parametrize(("name", "count"), [("without_wrists", 23), ("23dof", 23), ("waist_locked", 27)])
def test_a_variant_is_the_robot_with_joints_at_zero(name, count):
    whole, some = load_robot("g1"), load_robot(f"g1@{name}")
    assert len(some.joint_names) == count and set(some.joint_names) < set(whole.joint_names)
    q = np.random.default_rng(0).uniform(-0.3, 0.3, (5, 7 + count))
    q[:, 3:7] = [1.0, 0.0, 0.0, 0.0]
    full = np.zeros((5, 7 + len(whole.joint_names)))
    full[:, :7], full[:, [7 + whole.joint(j) for j in some.joint_names]] = q[:, :7], q[:, 7:]
    (a, _), (b, _) = forward_kinematics(some, q), forward_kinematics(whole, full)
    for body in some.body_names:
        assert np.allclose(a[:, some.body_names.index(body)], b[:, whole.body_names.index(body)], atol=1e-12)
    assert np.isclose(some.model.body_mass.sum(), whole.model.body_mass.sum())
    for joint in some.joint_names:  # gains and limits are the robot's
        assert some.effort[some.joint(joint)] == whole.effort[whole.joint(joint)]


def test_a_landmark_on_a_locked_body_stays_where_it_was():
    whole, some = load_robot("g1"), load_robot("g1@without_wrists")
    body = some.profile.landmarks["left_wrist"]
    assert body == "left_elbow_link" and "left_wrist" in some.profile.ends
    length = np.linalg.norm(some.profile.ends["left_wrist"])
    elbow, wrist = (whole.body_names.index(whole.profile.landmarks[f"left_{m}"]) for m in ("elbow", "wrist"))
    pos, _ = forward_kinematics(whole, np.r_[0, 0, 0, 1, 0, 0, 0, np.zeros(29)][None])
    assert np.isclose(length, np.linalg.norm(pos[0, elbow] - pos[0, wrist]), atol=1e-5)


def test_a_variant_that_is_none_or_locks_a_foot_is_refused(tmp_path):
    with pytest.raises(RobotError, match="no variant of that name.*without_wrists, 23dof, waist_locked"):
        load_robot("g1@left_handed")
    with pytest.raises(RobotError, match="the profile has no"):
        load_robot("h1@23dof")


def test_files_of_a_variant_are_read_by_its_own_name(tmp_path):
    """Two variants of g1 have 23 joints: a file without names is the first's, or the one's that is stated."""
    for name in ("without_wrists", "23dof"):
        robot = load_robot(f"g1@{name}")
        rows = np.tile(robot.default_qpos, (30, 1))
        rows[:, 3:7] = rows[:, [4, 5, 6, 3]]
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",")
    first = read_clip(tmp_path / "without_wrists.csv", ReadOptions(fps=30.0, quat_order="xyzw"))
    assert first.robot == "g1" and "waist_pitch_joint" in first.joint_names
    stated = read_clip(tmp_path / "23dof.csv", ReadOptions(fps=30.0, source_robot="g1@23dof", quat_order="xyzw"))
    assert "left_wrist_roll_joint" in stated.joint_names and "waist_pitch_joint" not in stated.joint_names
