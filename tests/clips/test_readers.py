"""Every reader on files made here: round trips through other people's layouts, and refusals that name the cure."""

import pickle

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, HumanClip, ReadOptions, RobotClip, full_qpos, read_clip
from clips.joint_space import breadth_first
from robot_models import forward_kinematics, load_robot
from robot_models import rotation as rot


@pytest.fixture
def motion(rng):
    """A G1 that sways on its feet: root position, root wxyz, joints."""
    robot = load_robot("g1")
    t = np.arange(90) / 30
    qpos = np.tile(robot.default_qpos, (90, 1))
    qpos[:, 3:7] = rot.from_yaw(0.9 + 0.2 * np.sin(t))
    qpos[:, 7 + robot.joint("left_shoulder_pitch_joint")] += 0.5 * np.sin(3 * t)
    qpos[:, 7 + robot.joint("right_elbow_joint")] += 0.3 * np.cos(2 * t)
    return qpos


def same(clip: RobotClip, qpos, tolerance=1e-6):
    got = full_qpos(clip, load_robot(clip.robot))
    np.testing.assert_allclose(got[:, :3], qpos[:, :3], atol=tolerance)
    assert rot.angle_between(got[:, 3:7], qpos[:, 3:7]).max() < 10 * tolerance
    np.testing.assert_allclose(got[:, 7:], qpos[:, 7:], atol=tolerance)


def write_rows(path, rows, first=""):
    path.write_text(first + "\n".join(",".join(f"{v:.8f}" for v in row) for row in rows) + "\n")
    return path


@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
def test_headerless_csv_is_read_right_in_either_quaternion_order(tmp_path, motion, order):
    rows = motion.copy()
    if order == "xyzw":
        rows[:, 3:7] = rot.to_quat_xyzw(motion[:, 3:7])
    clip = read_clip(write_rows(tmp_path / "m.csv", rows), ReadOptions(fps=30))
    assert {f.what: f.value for f in clip.source.findings}["quaternion order"] == order
    same(clip, motion)


def test_a_csv_without_a_rate_is_refused_with_the_option_that_gives_it(tmp_path, motion):
    with pytest.raises(ClipError) as e:
        read_clip(write_rows(tmp_path / "m.csv", motion))
    assert (e.value.option, e.value.suggestion) == ("fps", "30")


def test_a_rate_line_serves(tmp_path, motion):
    rows = motion.copy()
    rows[:, 3:7] = rot.to_quat_xyzw(motion[:, 3:7])
    assert read_clip(write_rows(tmp_path / "m.csv", rows, "# fps: 50\n")).fps == 50.0


@pytest.mark.parametrize("separator, decimal", [(";", ","), ("\t", "."), (";", "."), (" ", ".")])
def test_separators_decimals_and_a_byte_order_mark(tmp_path, motion, separator, decimal):
    rows = motion.copy()
    rows[:, 3:7] = rot.to_quat_xyzw(motion[:, 3:7])
    text = "\r\n".join(separator.join(f"{v:.8f}".replace(".", decimal) for v in row) for row in rows)
    (tmp_path / "m.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    same(read_clip(tmp_path / "m.csv", ReadOptions(fps=30)), motion)


def test_the_dance_environments_header_is_matched_by_name_in_any_order(tmp_path, rng):
    robot = load_robot("dancer")
    qpos = np.tile(robot.default_qpos, (60, 1))
    qpos[:, 3:7] = rot.from_yaw(np.full(60, 0.7))
    qpos[:, 7:] += 0.2 * np.sin(np.arange(60) / 10)[:, None] * rng.normal(size=28)
    qpos[:, 7:] = np.clip(qpos[:, 7:], robot.lower, robot.upper)
    names = list(robot.profile.csv_columns)
    rng.shuffle(names)
    header = ",".join(["px", "py", "pz", "qw", "qx", "qy", "qz", *(f"dof_{n}_link" for n in names)]) + "\n"
    order = [7 + robot.joint(n) for n in names]
    rows = np.concatenate((qpos[:, :7], qpos[:, order]), axis=1)
    same(read_clip(write_rows(tmp_path / "m.csv", rows, header), ReadOptions(fps=50)), qpos)


def test_seed_csv_in_cm_degrees_and_extrinsic_euler_angles(tmp_path, motion):
    robot = load_robot("g1")
    roll, pitch, yaw = 0.1, -0.2, 1.2
    quat = rot.multiply(
        rot.multiply(rot.from_yaw(np.array(yaw)), rot.exp(np.array([0, pitch, 0]))), rot.exp(np.array([roll, 0, 0]))
    )
    motion[:, 3:7] = quat
    header = ["Frame", *(f"root_translate{a}" for a in "XYZ"), *(f"root_rotate{a}" for a in "XYZ")]
    header += [f"{j.removesuffix('_joint')}_joint_dof" for j in robot.joint_names]
    rows = np.concatenate(
        (
            np.arange(90)[:, None],
            100 * motion[:, :3],
            np.degrees(np.tile([roll, pitch, yaw], (90, 1))),
            np.degrees(motion[:, 7:]),
        ),
        axis=1,
    )
    clip = read_clip(write_rows(tmp_path / "m.csv", rows, ",".join(header) + "\n"), ReadOptions(fps=120))
    assert clip.source.dialect == "SEED robot CSV"
    same(clip, motion)


def test_degrees_given_as_radians_are_refused(tmp_path, motion):
    motion[:, 7:] = np.degrees(motion[:, 7:])
    with pytest.raises(ClipError, match="radians"):
        read_clip(write_rows(tmp_path / "m.csv", motion), ReadOptions(fps=30, quat_order="wxyz"))


def test_a_ragged_row_is_named(tmp_path, motion):
    path = write_rows(tmp_path / "m.csv", motion)
    lines = path.read_text().splitlines()
    lines[41] = lines[41].rsplit(",", 2)[0]
    path.write_text("\n".join(lines))
    with pytest.raises(ClipError, match="row 42: found 34 columns, expected 36"):
        read_clip(path, ReadOptions(fps=30))


def test_another_robots_csv_is_refused(tmp_path, motion):
    with pytest.raises(ClipError, match="26 joint values"):
        read_clip(write_rows(tmp_path / "m.csv", motion[:, :33]), ReadOptions(fps=30))


def test_named_points_with_a_time_column_a_gap_and_shuffled_columns(tmp_path, rng):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    table = [line.split(",") for line in lines[1:]]
    order = rng.permutation(len(table[0]))
    (tmp_path / "p.csv").write_text("\n".join(",".join(row[i] for i in order) for row in table))
    plain, shuffled = read_clip(SAMPLES / "groove.csv"), read_clip(tmp_path / "p.csv")
    assert isinstance(shuffled, HumanClip) and shuffled.fps == pytest.approx(60.0)
    (filled,) = shuffled.source.repairs
    assert (filled.count, filled.of) == (3, "samples") and "lost samples" in filled.what
    np.testing.assert_array_equal(plain.point("left_wrist"), shuffled.point("left_wrist"))


def test_a_long_gap_is_refused_with_its_times(tmp_path):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    at = lines[1].split(",").index("left_wrist_x")
    for i in range(200, 240):
        cells = lines[i].split(",")
        cells[at : at + 3] = ["", "", ""]
        lines[i] = ",".join(cells)
    (tmp_path / "p.csv").write_text("\n".join(lines))
    with pytest.raises(ClipError, match=r"left_wrist.*no data from 3\.30 s to 3\.97 s"):
        read_clip(tmp_path / "p.csv")


def test_mirrored_points_are_refused(tmp_path):
    text = (SAMPLES / "groove.csv").read_text()
    swapped = text.replace("left_", "L#").replace("right_", "left_").replace("L#", "right_")
    (tmp_path / "p.csv").write_text(swapped)
    with pytest.raises(ClipError, match="left and right are swapped"):
        read_clip(tmp_path / "p.csv")


def test_time_that_runs_backwards_is_refused(tmp_path):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    lines[10], lines[11] = lines[11], lines[10]
    (tmp_path / "p.csv").write_text("\n".join(lines))
    with pytest.raises(ClipError, match="backwards"):
        read_clip(tmp_path / "p.csv")


def test_the_two_sample_files_are_one_dance():
    bvh, csv = read_clip(SAMPLES / "groove.bvh"), read_clip(SAMPLES / "groove.csv")
    for landmark in ("left_ankle", "right_wrist", "head"):
        a, b = (c.point(landmark) - c.point("pelvis")[:1] for c in (bvh, csv))
        # 1e-3 degrees of the BVH's rounding over a body's length, and the interpolated gap at the left wrist.
        np.testing.assert_allclose(np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1), atol=2e-4)


def test_bvh_channel_order_is_read_per_joint(tmp_path):
    text = (SAMPLES / "groove.bvh").read_text()
    other = text.replace("CHANNELS 3 Zrotation Yrotation Xrotation", "CHANNELS 3 Xrotation Yrotation Zrotation")
    (tmp_path / "x.bvh").write_text(other)
    a, b = read_clip(SAMPLES / "groove.bvh"), read_clip(tmp_path / "x.bvh")
    assert np.abs(a.point("left_wrist") - b.point("left_wrist")).max() > 0.05  # the order matters, and is obeyed


def test_bvh_position_channels_that_repeat_the_offset_do_not_double_the_bones(tmp_path):
    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    offset = next(line.split()[1:] for i, line in enumerate(lines) if "LeftLeg" in lines[i - 2] and "OFFSET" in line)
    at = next(i for i, line in enumerate(lines) if "JOINT LeftLeg" in line) + 3
    lines[at] = "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation"
    names = [line.split()[1] for line in lines if "JOINT" in line or "ROOT" in line]
    column = 6 + 3 * (names.index("LeftLeg") - 1)
    start = next(i for i, line in enumerate(lines) if "Frame Time" in line) + 1
    for i in range(start, len(lines)):
        cells = lines[i].split()
        lines[i] = " ".join(cells[:column] + offset + cells[column:])
    (tmp_path / "six.bvh").write_text("\n".join(lines))
    a, b = read_clip(SAMPLES / "groove.bvh"), read_clip(tmp_path / "six.bvh")
    np.testing.assert_allclose(a.point("left_ankle"), b.point("left_ankle"), atol=1e-5)


@pytest.mark.parametrize("factor, unit", [(1.0, "cm"), (0.01, "m"), (10.0, "mm"), (0.45 / 2.54, "cmu")])
def test_units_are_found_from_the_legs(tmp_path, factor, unit):
    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if "Frame Time" in line) + 1
    for i, line in enumerate(lines):
        words = line.split()
        if "OFFSET" in line:
            lines[i] = "OFFSET " + " ".join(repr(factor * float(w)) for w in words[1:])
        elif i >= start:
            lines[i] = " ".join([*(repr(factor * float(w)) for w in words[:3]), *words[3:]])
    (tmp_path / "u.bvh").write_text("\n".join(lines))
    clip = read_clip(tmp_path / "u.bvh")
    assert {f.what: f.value for f in clip.source.findings}["unit"] == unit
    assert clip.height == pytest.approx(read_clip(SAMPLES / "groove.bvh").height, rel=1e-3)


def test_a_cut_off_bvh_is_refused(tmp_path):
    text = (SAMPLES / "groove.bvh").read_text()
    (tmp_path / "c.bvh").write_text(text[: len(text) // 2])
    with pytest.raises(ClipError, match="expected 601 frames"):
        read_clip(tmp_path / "c.bvh")


def gmr(qpos):
    return {"fps": 30, "root_pos": qpos[:, :3], "root_rot": rot.to_quat_xyzw(qpos[:, 3:7]), "dof_pos": qpos[:, 7:],
            "local_body_pos": None, "link_body_list": None}  # fmt: skip


def test_gmr_pickle(tmp_path, motion):
    (tmp_path / "m.pkl").write_bytes(pickle.dumps(gmr(motion)))
    same(read_clip(tmp_path / "m.pkl"), motion)


@pytest.mark.parametrize("compress", [0, ("zlib", 3), ("gzip", 3), ("bz2", 3), ("xz", 3)])
def test_phc_pickle_through_joblib(tmp_path, motion, compress):
    import joblib

    robot = load_robot("g1")
    kept = [i for i, j in enumerate(robot.joint_names) if "wrist" not in j]
    content = {"clip": {"root_trans_offset": motion[:, :3], "root_rot": rot.to_quat_xyzw(motion[:, 3:7]),
                        "dof": motion[:, 7:][:, kept], "fps": 30}}  # fmt: skip
    joblib.dump(content, tmp_path / "m.pkl", compress=compress)
    clip = read_clip(tmp_path / "m.pkl")
    assert len(clip.joint_names) == 23
    assert any("wrist" in f.value and "default pose" in f.what for f in clip.source.findings)
    same(clip, motion)


def test_mimickit_pickle(tmp_path, motion):
    frames = np.concatenate((motion[:, :3], rot.log(motion[:, 3:7]), motion[:, 7:]), axis=1)
    (tmp_path / "m.pkl").write_bytes(pickle.dumps({"loop_mode": 0, "fps": 30, "frames": frames.tolist()}))
    same(read_clip(tmp_path / "m.pkl"), motion)


class Evil:
    def __reduce__(self):
        import os

        return os.system, ("touch /tmp/this_must_not_exist",)


@pytest.mark.parametrize("writer", ["pickle", "joblib", "object array"])
def test_a_pickle_that_wants_to_run_code_is_refused_before_it_runs(tmp_path, writer):
    import joblib

    path = tmp_path / "evil.pkl"
    if writer == "pickle":
        path.write_bytes(pickle.dumps({"root_pos": Evil()}))
    elif writer == "joblib":
        joblib.dump({"clip": {"dof": Evil()}}, path, compress=3)
    else:
        joblib.dump({"clip": {"dof": np.array([Evil()], dtype=object)}}, path)
    with pytest.raises(ClipError, match="wants to call|Python objects"):
        read_clip(path)


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


@pytest.mark.parametrize(
    "name, content, match",
    [
        ("a.fbx", b"Kaydara FBX Binary  \x00\x1a\x00", "Blender"),
        ("a.txt", b"hello", "content that no reader knows"),
        ("a.bvh", b"", "0 bytes"),
        ("a.npz", b"PK\x03\x04broken.npy", "broken archive"),
        ("a.pkl", b"\x80\x04broken", "broken pickle"),
        ("a.csv", b"1,2,3\n", "1 rows"),
    ],
)
def test_what_cannot_be_read_is_refused_by_name(tmp_path, name, content, match):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ClipError, match=match):
        read_clip(tmp_path / name)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ClipError, match="no such file"):
        read_clip(tmp_path / "nothing.bvh")


@pytest.mark.parametrize(
    "names",
    [
        "Hips Spine Spine1 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot LeftToeBase",
        "mixamorig:Hips mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand "
        "mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot mixamorig:LeftToeBase",
        "mixamorig1LeftArm mixamorig1LeftForeArm mixamorig1LeftHand mixamorig1LeftUpLeg mixamorig1LeftLeg mixamorig1LeftFoot",
        "Hips LeftCollar LeftShoulder LeftElbow LeftWrist LeftHip LeftKnee LeftAnkle LeftToe",
        "Hips Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L Toes_L",
        "pelvis left_collar left_shoulder left_elbow left_wrist left_hip left_knee left_ankle left_foot",
        "Root Hips LeftShoulder LeftArm LeftForeArm LeftHand LeftLeg LeftShin LeftFoot LeftToeBase",
        "Bip01 Bip01_L_Clavicle Bip01_L_UpperArm Bip01_L_Forearm Bip01_L_Hand Bip01_L_Thigh Bip01_L_Calf Bip01_L_Foot Bip01_L_Toe0",
        "J_Bip_C_Hips J_Bip_L_Shoulder J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand "
        "J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot",
        "DEF-spine DEF-upper_arm.L DEF-forearm.L DEF-hand.L DEF-thigh.L DEF-shin.L DEF-foot.L DEF-toe.L",
        "Character1_Hips Character1_LeftArm Character1_LeftForeArm Character1_LeftHand Character1_LeftUpLeg Character1_LeftLeg "
        "Character1_LeftFoot",
        "hip lCollar lShldrBend lForearmBend lHand lThighBend lShin lFoot",
        "Hips UpperArmL ForeArmL HandL ThighL ShinL FootL",
        "pelvis clavicle_l upperarm_l lowerarm_l hand_l thigh_l calf_l foot_l ball_l neck_01",
        "hip lCollar lShldr lForeArm lHand lThigh lShin lFoot lToe",
    ],
)
def test_the_left_limbs_are_found_in_every_naming_custom(names):
    from clips.skeleton import find_landmarks

    words = names.split()
    found = find_landmarks(words)
    order = [words.index(found[f"left_{p}"]) for p in ("shoulder", "elbow", "wrist")]
    legs = [words.index(found[f"left_{p}"]) for p in ("hip", "knee", "ankle")]
    assert order == sorted(order) and len(set(order)) == 3  # every custom lists its chains outwards
    assert legs == sorted(legs) and len(set(legs)) == 3
    assert "Collar" not in found["left_shoulder"] and "Clavicle" not in found["left_shoulder"]


@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
@pytest.mark.parametrize("yaw", [0.0, np.pi / 2, np.pi])
def test_a_robot_that_stands_still_at_any_heading_is_read_right_or_not_at_all(tmp_path, motion, order, yaw):
    motion[:, 3:7] = rot.from_yaw(np.full(90, yaw))
    rows = motion.copy()
    if order == "xyzw":
        rows[:, 3:7] = rot.to_quat_xyzw(motion[:, 3:7])
    path = write_rows(tmp_path / "m.csv", rows)
    try:
        clip = read_clip(path, ReadOptions(fps=30))
    except ClipError as e:
        assert e.option == "quat_order"
        clip = read_clip(path, ReadOptions(fps=30, quat_order=order))
    same(clip, motion)


def test_a_dance_environment_header_that_begins_with_x_is_no_pickle(tmp_path):
    robot = load_robot("dancer")
    qpos = np.tile(robot.default_qpos, (30, 1))
    header = ",".join(["x", "y", "z", "qw", "qx", "qy", "qz", *(f"dof_{n}_link" for n in robot.joint_names)]) + "\n"
    same(read_clip(write_rows(tmp_path / "m.csv", qpos, header), ReadOptions(fps=50)), qpos)


def test_a_robot_by_path_may_be_the_source(tmp_path, motion):
    from robot_models.profile import PROFILES

    (tmp_path / "g1.xml").write_text((PROFILES.parent / "assets" / "g1.xml").read_text())
    text = (
        (PROFILES / "g1.toml").read_text().replace("../assets/g1.xml", "g1.xml").replace('name = "g1"', 'name = "mine"')
    )
    (tmp_path / "mine.toml").write_text(text)
    path = write_rows(tmp_path / "m.csv", motion)
    clip = read_clip(path, ReadOptions(fps=30, robot=str(tmp_path / "mine.toml")))
    assert clip.robot == "mine"


def test_full_turns_are_taken_out_of_joint_angles_and_told(tmp_path, motion):
    wrapped = motion.copy()
    wrapped[40:, 9] += 2 * np.pi
    wrapped[:, 12] -= 2 * np.pi
    clip = read_clip(write_rows(tmp_path / "m.csv", wrapped), ReadOptions(fps=30, quat_order="wxyz"))
    same(clip, motion)
    assert any("full turns" in r.what for r in clip.source.repairs)


def test_centimetres_in_a_robots_root_are_refused(tmp_path, motion):
    motion[:, :3] *= 100
    with pytest.raises(ClipError, match="soles .* m over the floor"):
        read_clip(write_rows(tmp_path / "m.csv", motion), ReadOptions(fps=30, quat_order="wxyz"))


def edited_times(change):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines[1:]]
    at = rows[0].index("time")
    times = np.array([float(r[at]) for r in rows[1:]])
    for row, value in zip(rows[1:], change(times), strict=True):
        row[at] = f"{value:.6f}"
    return "\n".join(",".join(r) for r in rows)


@pytest.mark.parametrize(
    "change, match",
    [
        (lambda t: 1000 * t, "milliseconds"),
        (lambda t: t + 2.0 * (t > 5), "nothing between"),
    ],
)
def test_times_in_milliseconds_or_with_a_hole_are_refused(tmp_path, change, match):
    (tmp_path / "p.csv").write_text(edited_times(change))
    with pytest.raises(ClipError, match=match):
        read_clip(tmp_path / "p.csv")


def test_uneven_times_are_evened_for_points_and_refused_for_rotations(tmp_path, motion, rng):
    (tmp_path / "p.csv").write_text(edited_times(lambda t: t + 0.004 * rng.uniform(-1, 1, len(t))))
    clip = read_clip(tmp_path / "p.csv")
    assert any("even grid" in r.what for r in clip.source.repairs)
    times = np.arange(90) / 30 + 0.01 * rng.uniform(0, 1, 90)
    header = (
        "time," + ",".join(f"c{i}" for i in range(7)) + "," + ",".join(f"dof_{j}" for j in load_robot("g1").joint_names)
    )
    path = write_rows(tmp_path / "m.csv", np.concatenate((times[:, None], motion), axis=1), header + "\n")
    with pytest.raises(ClipError, match="uneven"):
        read_clip(path)


def test_lost_ends_are_cut_off_and_counted(tmp_path):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    at = lines[1].split(",").index("left_wrist_x")
    for row in (2, 3, -1):
        cells = lines[row].split(",")
        cells[at : at + 3] = ["", "", ""]
        lines[row] = ",".join(cells)
    (tmp_path / "p.csv").write_text("\n".join(lines))
    clip, whole = read_clip(tmp_path / "p.csv"), read_clip(SAMPLES / "groove.csv")
    assert clip.frames == whole.frames - 3
    np.testing.assert_array_equal(clip.point("right_knee"), whole.point("right_knee")[2:-1])
    assert clip.source.repairs[0].count == 3 and "at the ends" in clip.source.repairs[0].what


def test_a_stray_point_with_long_gaps_is_left_out(tmp_path):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    begin = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    for i in range(begin, len(lines)):
        extra = "stray_x,stray_y,stray_z" if i == begin else "0.1,0.2,0.3" if i % 40 < 20 else ",,"
        lines[i] += "," + extra
    (tmp_path / "p.csv").write_text("\n".join(lines))
    clip = read_clip(tmp_path / "p.csv")
    assert "stray" not in clip.names
    assert any("stray" in r.what for r in clip.source.repairs)


BROKEN_NPZ = {
    "no quaternions": {"body_quat_w": None},
    "flat joints": {"joint_pos": np.zeros(90, dtype=np.float32)},
    "fewer frames": {"joint_pos": np.zeros((10, 29), dtype=np.float32)},
    "text for a rate": {"fps": np.array("fast")},
    "text for joints": {"joint_pos": np.full((90, 29), "x")},
    "two axes of bodies": {"body_pos_w": np.zeros((90, 90), dtype=np.float32)},
}


@pytest.mark.parametrize("what", BROKEN_NPZ)
def test_broken_archives_are_refused_without_a_traceback(tmp_path, motion, what):
    data = bodies(motion, load_robot("g1").joint_names, list(range(30))) | BROKEN_NPZ[what]
    np.savez(tmp_path / "m.npz", **{k: v for k, v in data.items() if v is not None})
    with pytest.raises(ClipError):
        read_clip(tmp_path / "m.npz")


@pytest.mark.parametrize("fps", ["fast", [], None])
def test_a_pickle_with_a_broken_rate_is_refused(tmp_path, motion, fps):
    (tmp_path / "m.pkl").write_bytes(pickle.dumps(gmr(motion) | {"fps": fps}))
    with pytest.raises(ClipError, match="fps|frame rate"):
        read_clip(tmp_path / "m.pkl")
