"""NPZ: robot motions in either joint order, and SMPL poses."""

import numpy as np
import pytest
from round_trip import bodies, same

from clips import ClipError, read_clip
from clips.identify import breadth_first
from robot_models import load_robot


@pytest.mark.parametrize("order", ["MuJoCo depth-first", "Isaac breadth-first"])
def test_a_nameless_motion_is_read_in_the_order_that_its_bodies_prove(tmp_path, motion, order):
    robot = load_robot("g1")
    names = robot.joint_names if "depth" in order else breadth_first(robot)
    data = bodies(motion, names, [0, *(1 + robot.joint(j) for j in names)])
    np.savez(tmp_path / "m.npz", **data)
    clip = read_clip(tmp_path / "m.npz")
    assert {f.what: f.value for f in clip.source.findings}["joint order"] == order
    same(clip, motion, 1e-5)


def test_a_motion_whose_bodies_fit_no_order_is_refused(tmp_path, motion):
    data = bodies(motion, load_robot("g1").joint_names, list(range(30)))
    data["body_pos_w"] = data["body_pos_w"][:, ::-1]
    np.savez(tmp_path / "m.npz", **data)
    with pytest.raises(ClipError, match="no joint order"):
        read_clip(tmp_path / "m.npz")


@pytest.mark.parametrize("order", ["MuJoCo depth-first", "Isaac breadth-first"])
def test_a_motion_that_begins_with_the_world_is_read_without_it(tmp_path, motion, order):
    """As mjlab writes all of MuJoCo's bodies."""
    robot = load_robot("g1")
    names = robot.joint_names if "depth" in order else breadth_first(robot)
    data = bodies(motion, names, [0, *(1 + robot.joint(j) for j in names)])
    still = {"body_pos_w": (0.0, 0.0, 0.0), "body_quat_w": (1.0, 0.0, 0.0, 0.0)}
    with_world = {k: np.concatenate((np.tile(v, (len(data[k]), 1, 1)), data[k]), axis=1) for k, v in still.items()}
    np.savez(tmp_path / "m.npz", **(data | with_world))
    clip = read_clip(tmp_path / "m.npz")
    told = {f.what: f.value for f in clip.source.findings}
    assert told["body 0"] == "the world, left out" and told["joint order"] == order
    same(clip, motion, 1e-5)
    with_world["body_pos_w"][3, 0, 2] = 0.1  # what moves is no world
    np.savez(tmp_path / "m.npz", **(data | with_world))
    with pytest.raises(ClipError):
        read_clip(tmp_path / "m.npz")


def test_breadth_first_order_is_isaacs():
    names = [n.removesuffix("_joint") for n in breadth_first(load_robot("g1"))]
    assert names[:6] == [
        "left_hip_pitch",
        "right_hip_pitch",
        "waist_yaw",
        "left_hip_roll",
        "right_hip_roll",
        "waist_roll",
    ]
    assert names[-1] == "right_wrist_yaw"


def test_isaac_amp_is_matched_by_name(tmp_path, motion):
    robot = load_robot("g1")
    names = breadth_first(robot)
    data = bodies(motion, names, list(range(30)))
    np.savez(
        tmp_path / "m.npz", fps=30, dof_names=names, body_names=robot.body_names, dof_positions=data["joint_pos"],
        body_positions=data["body_pos_w"], body_rotations=data["body_quat_w"],
    )  # fmt: skip
    same(read_clip(tmp_path / "m.npz"), motion, 1e-5)


@pytest.mark.parametrize("values, family", [(72, "SMPL"), (156, "SMPL-H"), (165, "SMPL-X")])
def test_smpl_rest_pose_is_a_t_pose_facing_forward(tmp_path, values, family):
    poses = np.zeros((10, values))
    poses[:, :3] = [np.pi / 2, 0, 0]  # the model's y up -> AMASS' z up
    np.savez(tmp_path / "s.npz", poses=poses, trans=np.tile([0, 0, 1.15], (10, 1)), mocap_framerate=30)
    clip = read_clip(tmp_path / "s.npz")
    assert family in clip.source.dialect
    wrists = clip.point("left_wrist")[0] - clip.point("right_wrist")[0]
    assert abs(wrists[2]) < 0.05 and np.linalg.norm(wrists) > 1.2
    assert clip.point("head")[0, 2] - clip.point("left_ankle")[0, 2] > 1.2


def test_both_spellings_of_the_amass_rate_and_no_rate(tmp_path):
    base = {"poses": np.tile([np.pi / 2, *np.zeros(71)], (10, 1)), "trans": np.zeros((10, 3))}
    for key in ("mocap_framerate", "mocap_frame_rate"):
        np.savez(tmp_path / "s.npz", **base, **{key: 120.0})
        assert read_clip(tmp_path / "s.npz").fps == 120.0
    np.savez(tmp_path / "s.npz", **base)
    with pytest.raises(ClipError) as e:
        read_clip(tmp_path / "s.npz")
    assert e.value.option == "fps"


BROKEN_NPZ = {
    "no quaternions": {"body_quat_w": None},
    "flat joints": {"joint_pos": np.zeros(90, dtype=np.float32)},
    "fewer frames": {"joint_pos": np.zeros((10, 29), dtype=np.float32)},
    "text for a rate": {"fps": np.array("fast")},
    "text for joints": {"joint_pos": np.full((90, 29), "x")},
    "no bodies turned": {"body_quat_w": np.zeros((90, 0, 4), dtype=np.float32)},
    "bodies of five numbers": {"body_quat_w": np.zeros((90, 30, 5), dtype=np.float32)},
    "two axes of bodies": {"body_pos_w": np.zeros((90, 90), dtype=np.float32)},
}


@pytest.mark.parametrize("what", BROKEN_NPZ)
def test_broken_archives_are_refused_without_a_traceback(tmp_path, motion, what):
    data = bodies(motion, load_robot("g1").joint_names, list(range(30))) | BROKEN_NPZ[what]
    np.savez(tmp_path / "m.npz", **{k: v for k, v in data.items() if v is not None})
    with pytest.raises(ClipError):
        read_clip(tmp_path / "m.npz")
