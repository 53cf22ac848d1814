"""The bad inputs that users of motion files meet, numbered; each is read rightly, mended with a note, or refused with its cure."""

import pickle
import re

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, ReadOptions, cut, full_qpos, read_clip, repair
from clips.identify import breadth_first
from robot_models import RobotError, load_robot
from robot_models.maths import rotation as rot
from robot_models.profile import PROFILES

FRAMES, FPS = 90, 30.0


@pytest.fixture
def g1():
    return load_robot("g1")


@pytest.fixture
def qpos(g1):
    """A G1 that turns and bows on its feet."""
    t = np.arange(FRAMES) / FPS
    rows = np.tile(g1.default_qpos, (FRAMES, 1))
    rows[:, 3:7] = rot.from_yaw(0.9 + 0.4 * t)
    for joint, size in (
        ("left_shoulder_pitch", 0.9),
        ("right_elbow", 0.6),
        ("waist_yaw", 0.5),
        ("right_shoulder_roll", -0.5),
    ):
        rows[:, 7 + g1.joint(f"{joint}_joint")] += size * np.sin(2 * t) ** 2
    return rows


@pytest.fixture
def points():
    """Lines of the sample CSV of named points, the header first."""
    return (SAMPLES / "groove.csv").read_text().splitlines()


def unitree(qpos):
    return qpos[:, [0, 1, 2, 4, 5, 6, 3, *range(7, qpos.shape[1])]]


def csv(path, rows, header=""):
    path.write_text(header + "\n".join(",".join(f"{v:.8f}" for v in row) for row in rows) + "\n")
    return path


def seed(qpos, robot):
    """SEED / SONIC: the same 36 columns and a frame number; centimetres, Euler degrees, degrees."""
    names = ["Frame", *(f"root_translate{a}" for a in "XYZ"), *(f"root_rotate{a}" for a in "XYZ")]
    names += [f"{j.removesuffix('_joint')}_joint_dof" for j in robot.joint_names]
    euler = np.degrees(np.stack((np.zeros(len(qpos)), np.zeros(len(qpos)), rot.yaw(qpos[:, 3:7])), axis=1))
    rows = np.concatenate((np.arange(len(qpos))[:, None], 100 * qpos[:, :3], euler, np.degrees(qpos[:, 7:])), axis=1)
    return rows, ",".join(names) + "\n"


def refused(match, path, option="", **options):
    with pytest.raises(ClipError, match=match) as refusal:
        repair(read_clip(path, ReadOptions(**options)))
    assert refusal.value.option == option
    return refusal.value


def test_01_two_dialects_of_36_columns_are_told_apart(tmp_path, qpos, g1):
    rows, header = seed(qpos, g1)
    a = read_clip(csv(tmp_path / "a.csv", unitree(qpos)), ReadOptions(fps=FPS))
    b = read_clip(csv(tmp_path / "b.csv", rows, header), ReadOptions(fps=FPS))
    np.testing.assert_allclose(full_qpos(a, g1), full_qpos(b, g1), atol=1e-6)
    headless = csv(tmp_path / "c.csv", rows[:, 1:])  # its header lost, and with it what the numbers are
    refused("expected radians", headless, fps=FPS)
    refused("expected radians", csv(tmp_path / "d.csv", rows), fps=FPS)


def test_02_neither_the_header_is_data_nor_the_first_frame_a_header(tmp_path, qpos, g1):
    rows, header = seed(qpos, g1)
    for path in (csv(tmp_path / "a.csv", unitree(qpos)), csv(tmp_path / "b.csv", rows, header)):
        assert read_clip(path, ReadOptions(fps=FPS)).frames == FRAMES


def test_03_a_range_is_in_seconds_and_its_frames_are_told(tmp_path, qpos):
    part = cut(read_clip(csv(tmp_path / "a.csv", unitree(qpos)), ReadOptions(fps=FPS)), 1.0, 2.0)
    assert part.frames == 31 and "frames [30, 61)" in part.source.conversions[-1]


@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
def test_04_quaternions_of_either_order_flipped_zero_and_too_long(tmp_path, qpos, g1, order):
    rows = unitree(qpos) if order == "xyzw" else qpos.copy()
    rows[40:60, 3:7] *= -1.0
    clip = read_clip(csv(tmp_path / "a.csv", rows), ReadOptions(fps=FPS))
    np.testing.assert_allclose(rot.yaw(clip.root_quat), rot.yaw(qpos[:, 3:7]), atol=1e-6)
    assert [(r.what, r.count) for r in clip.source.repairs] == [("quaternion signs made continuous", 2)]
    rows[50, 3:7] = 0.0
    refused("frame 50: found root quaternion of length 0", csv(tmp_path / "b.csv", rows), fps=FPS)
    rows[50, 3:7] = 1.0
    refused("frame 50: found root quaternion of length 2", csv(tmp_path / "c.csv", rows), fps=FPS)


def test_05_an_euler_order_that_differs_from_joint_to_joint(tmp_path):
    text = (SAMPLES / "groove.bvh").read_text()
    names, head = re.findall(r"CHANNELS (\d) ([^\n]*)", text), text.index("MOTION")
    assert len(names) > 10
    lines = text[head:].splitlines()
    values = np.array([line.split() for line in lines[3:] if line.strip()], dtype=float)
    order, column, turned = [], 0, 0
    for count, words in names:
        width = int(count)
        channels = words.split()
        swapped = list(range(width))
        angles = [k for k in swapped if "rotation" in channels[k]]
        if turned % 2:  # every other joint in another order: the same rotation by other angles
            letters = "".join(channels[k][0] for k in angles)
            quat = rot.from_euler(np.radians(values[:, [column + k for k in angles]]), letters)
            values[:, [column + k for k in angles]] = np.degrees(_euler(quat, letters[1:] + letters[0]))
            channels = channels[:-3] + [f"{c}rotation" for c in letters[1:] + letters[0]]
        order.append(" ".join(channels))
        column, turned = column + width, turned + 1
    mixed = iter(order)
    top = re.sub(r"(CHANNELS \d) [^\n]*", lambda m: f"{m[1]} {next(mixed)}", text[:head])
    body = "\n".join(" ".join(f"{v:.8f}" for v in row) for row in values)
    (tmp_path / "mixed.bvh").write_text(top + "\n".join(lines[:3]) + "\n" + body + "\n")
    a, b = read_clip(SAMPLES / "groove.bvh"), read_clip(tmp_path / "mixed.bvh")
    np.testing.assert_allclose(b.positions, a.positions, atol=1e-5)
    assert ", " in next(f.value for f in b.source.findings if f.what == "Euler order")


def _euler(quat, letters):
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(rot.to_quat_xyzw(quat)).as_euler(letters)


def test_06_degrees_for_radians(tmp_path, qpos):
    rows = unitree(qpos)
    rows[:, 7:] = np.degrees(rows[:, 7:])
    refused("expected radians; the file seems to hold degrees", csv(tmp_path / "a.csv", rows), fps=FPS)


def test_07_centimetres_for_metres(tmp_path, qpos):
    rows = unitree(qpos)
    rows[:, :3] *= 100.0
    refused("soles .* m over the floor.*look like centimetres", csv(tmp_path / "a.csv", rows), fps=FPS)
    refused("a robot's own file beside it", csv(tmp_path / "b.csv", rows), "unit", fps=FPS, unit="cm")
    refusal = refused("a person 1[0-9.e+]* m tall, with unit m", SAMPLES / "groove.bvh", "unit", unit="m")
    assert refusal.suggestion == "cm"


def test_08_another_up_axis_is_turned_and_a_mirrored_world_refused(tmp_path, points):
    head, *rows = (
        [line.split(",") for line in points[1:]] if points[0].startswith("#") else [p.split(",") for p in points]
    )
    table = np.array([[float(c) if c else np.nan for c in row] for row in rows])
    y_up, mirror = table.copy(), table.copy()
    for i, name in enumerate(head):
        if name.endswith("_y"):
            y_up[:, i], y_up[:, i + 1] = table[:, i + 1], -table[:, i]  # a turn: (x, z, -y)
            mirror[:, i] = -table[:, i]

    def write(path, values):
        lines = [",".join("" if np.isnan(v) else f"{v:.6f}" for v in row) for row in values]
        path.write_text("\n".join([",".join(head), *lines]))
        return path

    plain, turned = read_clip(SAMPLES / "groove.csv"), read_clip(write(tmp_path / "y.csv", y_up))
    np.testing.assert_allclose(turned.positions, plain.positions, atol=1e-5)
    refused("left and right are swapped, or the file is mirrored", write(tmp_path / "m.csv", mirror))


def test_09_a_rate_that_is_missing_or_cannot_be(tmp_path, qpos):
    path = csv(tmp_path / "a.csv", unitree(qpos))
    assert refused("no frame rate", path, "fps").suggestion == ""
    text = (SAMPLES / "groove.bvh").read_text()
    (tmp_path / "ms.bvh").write_text(re.sub(r"Frame Time: .*", "Frame Time: 16.6667", text))
    refused("0.0599999 frames per second, expected 1 to 2000", tmp_path / "ms.bvh", "fps")
    rows = unitree(qpos)
    rows[:, 0] += 0.3 * np.arange(FRAMES)  # nine metres a second at 30: ninety at 300
    path = csv(tmp_path / "b.csv", rows)
    assert repair(read_clip(path, ReadOptions(fps=FPS))).frames == FRAMES
    refused("hips that jump .* is its frame rate wrong", path, fps=300.0)


def test_10_times_that_repeat_run_back_or_leave_a_hole(tmp_path, qpos):
    rows = unitree(qpos)
    names = "time,x,y,z,qx,qy,qz,qw," + ",".join(f"dof_{j}" for j in load_robot("g1").joint_names) + "\n"
    time = np.arange(FRAMES) / FPS

    def timed(name, at, rows=rows):
        return csv(tmp_path / name, np.concatenate((at[:, None], rows), axis=1), names)

    twice = timed("a.csv", np.insert(time, 20, time[20]), np.insert(rows, 20, rows[20], axis=0))
    clip = read_clip(twice, ReadOptions(quat_order="xyzw"))
    assert clip.frames == FRAMES and clip.fps == pytest.approx(FPS)
    assert clip.source.repairs[0].what == "rows of a repeated time left out"
    back = time.copy()
    back[30] = back[28]
    refused("time that runs backwards", timed("b.csv", back), quat_order="xyzw")
    hole = np.where(np.arange(FRAMES) < 40, time, time + 0.5)
    refused("nothing between 1.3 s and 1.83333 s", timed("c.csv", hole), quat_order="xyzw")


def test_11_lost_markers_are_filled_or_refused_and_strays_left_out(tmp_path, points):
    head = next(i for i, line in enumerate(points) if not line.startswith("#"))
    column = points[head].split(",").index("left_knee_x")

    def lost(count):
        lines = points.copy()
        for i in range(head + 100, head + 100 + count):
            cells = lines[i].split(",")
            cells[column : column + 3] = ["", "", ""]
            lines[i] = ",".join(cells)
        (tmp_path / "p.csv").write_text("\n".join(lines))
        return tmp_path / "p.csv"

    assert sum(r.count for r in read_clip(lost(5)).source.repairs) == 5 + 3  # three are the sample's own
    refused(r"left_knee'.*no data from 1\.65 s to 1\.85 s", lost(12))


@pytest.mark.parametrize("count", [1, 2])
def test_12_too_few_frames(tmp_path, qpos, count):
    refused(f"{count} (rows|frames)", csv(tmp_path / "a.csv", unitree(qpos)[:count]), fps=FPS)
    (tmp_path / "empty.csv").write_text("")
    refused("0 bytes", tmp_path / "empty.csv", fps=FPS)


def test_13_another_number_of_joints_is_named_or_refused(tmp_path, qpos, g1):
    keep = [i for i, j in enumerate(g1.joint_names) if "wrist" not in j]
    rows = unitree(qpos)
    clip = read_clip(csv(tmp_path / "a.csv", rows[:, [*range(7), *(7 + i for i in keep)]]), ReadOptions(fps=FPS))
    held = next(f for f in clip.source.findings if f.what == "joints held at the default pose")
    assert "left_wrist_roll_joint" in held.value and "23 of 29" in held.why
    wide = np.concatenate((rows, np.zeros((FRAMES, 14))), axis=1)
    refused("43 joint values.*known robot's number", csv(tmp_path / "b.csv", wide), "source_robot", fps=FPS)


def test_14_the_right_number_of_joints_in_another_order(tmp_path, qpos, g1):
    joints = qpos[:, 7:][:, [g1.joint(n) for n in breadth_first(g1)]]
    rows = np.concatenate((unitree(qpos)[:, :7], joints), axis=1)
    clip = read_clip(csv(tmp_path / "a.csv", rows), ReadOptions(fps=FPS))
    np.testing.assert_allclose(full_qpos(clip, g1), qpos, atol=1e-6)
    assert next(f.value for f in clip.source.findings if f.what == "joint order") == "isaac"
    shuffled = unitree(qpos)
    shuffled[:, 7:] = shuffled[:, 7:][:, np.random.default_rng(3).permutation(29)]
    with pytest.raises(ClipError, match="limits|order|tilted|stands"):
        read_clip(csv(tmp_path / "b.csv", shuffled), ReadOptions(fps=FPS))


def test_15_an_archive_without_names_is_read_as_its_bodies_prove_or_refused(tmp_path, qpos, g1):
    from robot_models import forward_kinematics

    pos, quat = forward_kinematics(g1, qpos)
    isaac = breadth_first(g1)
    bodies = [0, *(1 + g1.joint(n) for n in isaac)]
    arrays = {"fps": [50], "joint_pos": qpos[:, 7:][:, [g1.joint(n) for n in isaac]]}
    np.savez(tmp_path / "a.npz", body_pos_w=pos[:, bodies], body_quat_w=quat[:, bodies], **arrays)
    np.testing.assert_allclose(full_qpos(read_clip(tmp_path / "a.npz"), g1)[:, 7:], qpos[:, 7:], atol=1e-6)
    np.savez(tmp_path / "b.npz", body_pos_w=pos, body_quat_w=quat, **arrays)
    refused("bodies that no joint order of g1 reproduces", tmp_path / "b.npz", "source_robot")


def test_16_links_for_joints_are_matched_and_strangers_named(tmp_path, qpos, g1):
    links = dict(zip(g1.joint_names, g1.body_names[1:], strict=True))
    names = "x,y,z,qw,qx,qy,qz," + ",".join(f"dof_{links[j]}" for j in g1.joint_names)
    clip = read_clip(csv(tmp_path / "a.csv", qpos, names + "\n"), ReadOptions(fps=FPS))
    np.testing.assert_allclose(full_qpos(clip, g1), qpos, atol=1e-6)
    strange = csv(tmp_path / "b.csv", qpos, names.replace("dof_left_knee_link", "dof_left_shank_link") + "\n")
    assert refused("g1 comes nearest, without left_shank_link", strange, "source_robot", fps=FPS).suggestion == "g1"


def test_17_a_clip_far_away_with_a_false_start_begins_at_the_origin(tmp_path, dancer):
    from retarget import retarget

    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    rest = " ".join(["0"] * len(lines[first].split()))
    led = [*lines[: first - 2], "Frames: 92", lines[first - 1], rest, *lines[first : first + 91]]
    (tmp_path / "led.bvh").write_text("\n".join(led))
    result = retarget(read_clip(tmp_path / "led.bvh"), dancer)
    start = result.reference.dance.start
    np.testing.assert_allclose(result.reference.body_pos_w[start, 0, :2], 0.0, atol=0.05)
    assert any("jump" in r.what or "T-pose" in r.what for r in result.source.source.repairs) or rest == lines[first]


def test_18_a_sloped_floor_is_levelled_and_told(points, tmp_path):
    head = next(i for i, line in enumerate(points) if not line.startswith("#"))
    names = points[head].split(",")
    lines = points[: head + 1]
    for row, line in enumerate(points[head + 1 :]):
        cells = line.split(",")
        for i, name in enumerate(names):
            if name.endswith("_z") and cells[i]:
                unit = 1000.0 if abs(float(cells[i])) > 10 else 1.0
                cells[i] = f"{float(cells[i]) + unit * 0.03 * row / 60.0:.6f}"
        lines.append(",".join(cells))
    (tmp_path / "p.csv").write_text("\n".join(lines))
    (mended,) = [r for r in repair(read_clip(tmp_path / "p.csv")).source.repairs if "floor" in r.what]
    assert "drifts by 3.0 cm/s" in mended.what


def test_19_joined_clips_are_refused_at_the_seam(tmp_path, qpos):
    rows = unitree(qpos)
    rows[45:, 1] += 1.5
    refused(r"frame 45: found hips that jump 1\.50 m.*cut the clip there", csv(tmp_path / "a.csv", rows), fps=FPS)


def test_20_a_pickle_that_wants_code_and_one_of_many_clips(tmp_path):
    (tmp_path / "a.pkl").write_bytes(b"\x80\x02cos\nsystem\n(X\x02\0\0\0lstR.")
    refused("wants to call os.system.*unless you trust", tmp_path / "a.pkl")
    (tmp_path / "b.pkl").write_bytes(pickle.dumps({f"clip {i}": {"dof": np.zeros((9, 23))} for i in range(4)}))
    refused("4 clips.*say which, by name or by number", tmp_path / "b.pkl", option="person")


def test_21_robot_files_without_a_free_joint_a_mesh_or_a_range(tmp_path):
    spec = (PROFILES.parent / "assets" / "dancer.xml").read_text()
    profile = (PROFILES / "dancer.toml").read_text().replace('"../assets/dancer.xml"', '"r.xml"')
    welded = re.sub(r"<freejoint[^>]*/>", "", spec)
    assert welded != spec
    (tmp_path / "r.toml").write_text(profile)
    (tmp_path / "r.xml").write_text(welded)
    assert load_robot(str(tmp_path / "r.toml")).joint_names == load_robot("dancer").joint_names
    other = tmp_path / "free"
    other.mkdir()
    (other / "r.toml").write_text(profile)
    (other / "r.xml").write_text(re.sub(r'(name="left_knee"[^>]*?) range="[^"]*"', r'\1 limited="false"', spec))
    with pytest.raises(RobotError, match="no position limit for left_knee, expected a range"):
        load_robot(str(other / "r.toml"))
    third = tmp_path / "body"
    third.mkdir()
    (third / "r.toml").write_text(profile.replace('left_knee = "left_knee_link"', 'left_knee = "left_shin"'))
    (third / "r.xml").write_text(spec)
    with pytest.raises(RobotError, match="left_shin"):
        load_robot(str(third / "r.toml"))


def test_22_the_wrong_family_of_body_models_and_a_model_for_a_motion(tmp_path):
    np.savez(tmp_path / "a.npz", poses=np.zeros((9, 63)), trans=np.zeros((9, 3)), mocap_framerate=30)
    refused(r"shape \(9, 63\).*expected frames by 66, 72 \(SMPL\), 156 \(SMPL-H\)", tmp_path / "a.npz")
    (tmp_path / "model.pkl").write_bytes(b"\x80\x02cchumpy.ch\nCh\n)R.")
    refused("wants to call chumpy.ch.Ch", tmp_path / "model.pkl")


@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), ("\t", "."), (",", ".")])
def test_23_marks_separators_and_line_ends_of_every_tool(tmp_path, qpos, g1, separator, decimal):
    lines = [separator.join(f"{v:.8f}".replace(".", decimal) for v in row) for row in unitree(qpos)]
    end = separator if separator == "," else ""
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(line + end for line in lines).encode())
    np.testing.assert_allclose(full_qpos(read_clip(tmp_path / "a.csv", ReadOptions(fps=FPS)), g1), qpos, atol=1e-6)
