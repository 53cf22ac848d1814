"""Files in other people's layouts, made from a known motion, and the comparison with it."""

import numpy as np
from conftest import SAMPLES

from clips import RobotClip, full_qpos
from robot_models import forward_kinematics, load_robot
from robot_models.maths import rotation as rot


def same(clip: RobotClip, qpos, tolerance=1e-6):
    got = full_qpos(clip, load_robot(clip.robot))
    np.testing.assert_allclose(got[:, :3], qpos[:, :3], atol=tolerance)
    assert rot.angle_between(got[:, 3:7], qpos[:, 3:7]).max() < 10 * tolerance
    np.testing.assert_allclose(got[:, 7:], qpos[:, 7:], atol=tolerance)


def write_rows(path, rows, first=""):
    path.write_text(first + "\n".join(",".join(f"{v:.8f}" for v in row) for row in rows) + "\n")
    return path


def gmr(qpos):
    return {"fps": 30, "root_pos": qpos[:, :3], "root_rot": rot.to_quat_xyzw(qpos[:, 3:7]), "dof_pos": qpos[:, 7:],
            "local_body_pos": None, "link_body_list": None}  # fmt: skip


def bodies(qpos, joint_order, body_order):
    robot = load_robot("g1")
    pos, quat = forward_kinematics(robot, qpos)
    joints = [robot.joint(j) for j in joint_order]
    return {
        "fps": np.array([30.0]),
        "joint_pos": qpos[:, 7:][:, joints].astype(np.float32),
        "body_pos_w": pos[:, body_order].astype(np.float32),
        "body_quat_w": quat[:, body_order].astype(np.float32),
    }


def edited_times(change):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines[1:]]
    at = rows[0].index("time")
    times = np.array([float(r[at]) for r in rows[1:]])
    for row, value in zip(rows[1:], change(times), strict=True):
        row[at] = f"{value:.6f}"
    return "\n".join(",".join(r) for r in rows)
