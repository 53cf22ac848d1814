"""Which robot a file without names is of, where several have as many joints."""

import numpy as np
import pytest

from clips import ClipError, ReadOptions, read_clip
from robot_models import load_robot


def moved(name, frames=60):
    """Knees bent and arms swung in the robot's own order, the lower sole on the floor all the time."""
    robot = load_robot(name)
    t = np.linspace(0.0, 2.0 * np.pi, frames)
    qpos = np.tile(robot.default_qpos, (frames, 1))
    for k, joint in enumerate(robot.joint_names):
        if "houlder" in joint or "lbow" in joint:
            middle = 0.5 * (robot.lower[k] + robot.upper[k])
            qpos[:, 7 + k] += 0.3 * (1.0 - np.cos(t)) * np.sign(middle - robot.default_qpos[7 + k])
    return robot, qpos


@pytest.mark.parametrize("name", ["t1", "n1", "k1", "pm01", "h1_2", "r1"])
def test_a_table_of_angles_is_its_own_robots(name, tmp_path):
    robot, qpos = moved(name)
    rows = qpos.copy()
    rows[:, 3:7] = qpos[:, [4, 5, 6, 3]]
    np.savetxt(tmp_path / "x.csv", rows, delimiter=",")
    clip = read_clip(tmp_path / "x.csv", ReadOptions(fps=30.0, quat_order="xyzw"))
    assert clip.robot == name and clip.joint_names == robot.joint_names


def test_names_that_two_robots_have_are_the_ones_that_lacks_fewest(tmp_path):
    """G1's 29 names are all among H2's 31."""
    import pickle

    for name in ("g1", "h2"):
        robot, qpos = moved(name)
        content = {
            "fps": 30, "root_pos": qpos[:, :3], "root_rot": qpos[:, [4, 5, 6, 3]], "dof_pos": qpos[:, 7:],
            "joint_names": list(robot.joint_names),
        }  # fmt: skip
        (tmp_path / "x.pkl").write_bytes(pickle.dumps(content))
        assert read_clip(tmp_path / "x.pkl").robot == name


def test_angles_that_are_as_little_of_one_robot_as_of_another_are_refused(tmp_path):
    rows = np.zeros((40, 7 + 23))
    rows[:, 2], rows[:, 6] = 5.0, 1.0  # five metres over the floor
    np.savetxt(tmp_path / "x.csv", rows, delimiter=",")
    with pytest.raises(ClipError, match="23 joint values per frame, which 3 robots have") as refusal:
        read_clip(tmp_path / "x.csv", ReadOptions(fps=30.0))
    assert refusal.value.option == "source_robot"
