"""CSV: robot joints and named points, their separators, units, times and headers."""

import numpy as np
import pytest
from conftest import SAMPLES
from round_trip import edited_times, same, write_rows

from clips import ClipError, HumanClip, ReadOptions, read_clip
from robot_models import load_robot
from robot_models.maths import rotation as rot


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
    assert (e.value.option, e.value.suggestion) == ("fps", "")  # who only stands sways at no rate


@pytest.mark.parametrize(
    ("file", "rate"), [("csv/g1moves/J_Dance12_LushLife.csv", "60"), ("csv/lafan1_g1_dance1_subject2.csv", "30")]
)
def test_a_csv_without_a_rate_is_judged_by_how_its_body_sways(shared, file, rate):
    with pytest.raises(ClipError, match="sways over its standing feet") as e:
        read_clip(shared / file)
    assert (e.value.option, e.value.suggestion) == ("fps", rate)


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
    with pytest.raises(ClipError, match="25 joint values"):
        read_clip(write_rows(tmp_path / "m.csv", motion[:, :32]), ReadOptions(fps=30))


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
    clip = read_clip(path, ReadOptions(fps=30, source_robot=str(tmp_path / "mine.toml")))
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


@pytest.mark.parametrize(("fps", "good"), [(1.0, True), (1.5, True), (0.9, False)])
def test_a_time_column_may_be_as_slow_as_any_other_file(fps, good, tmp_path):
    rows = [f"{k / fps},{0.0},{0.0},{0.79},1,0,0,0," + ",".join(["0.0"] * 29) for k in range(8)]
    names = ["time", "x", "y", "z", "qw", "qx", "qy", "qz"]
    names += [f"dof_{name}" for name in load_robot("g1").joint_names]
    path = tmp_path / "slow.csv"
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    if good:
        assert read_clip(path).fps == pytest.approx(fps)
    else:
        with pytest.raises(ClipError, match="step of 1.1"):
            read_clip(path)


def test_of_several_files_a_stated_rate_is_for_those_that_do_not_say_theirs(tmp_path, motion):
    from conftest import SAMPLES

    from clips import read_of_several

    rows = write_rows(tmp_path / "m.csv", motion)
    assert read_of_several(rows, ReadOptions(fps=30)).fps == 30
    assert read_of_several(SAMPLES / "groove.bvh", ReadOptions(fps=30)).fps == pytest.approx(60.0)
    assert read_clip(SAMPLES / "groove.bvh", ReadOptions(fps=30)).fps == 30
    with pytest.raises(ClipError):
        read_of_several(rows, ReadOptions())
