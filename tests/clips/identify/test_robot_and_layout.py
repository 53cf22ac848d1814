"""Joint columns to a robot's clip: names find their columns, orders are found by what stands, statements obeyed."""

from pathlib import Path

import numpy as np
import pytest
from stick_person import SOURCE, tagged

from clips import ClipError, ReadOptions, RobotClip, full_qpos
from clips.identify import breadth_first, choose_layout, joint_order, robot_clip
from clips.identify.joint_layout import NamelessMotion, layouts
from clips.provenance import RawFile
from robot_models import installed, load_robot, robot_names
from robot_models.maths import rotation as rot

RAW = RawFile(path=Path("file.x"), data=b"x")
FRAMES = 60


@pytest.fixture(scope="module")
def g1():
    return load_robot("g1")


@pytest.fixture
def sway(g1):
    """A G1 on its feet that turns, bows and swings its arms, no two joints alike."""
    t = np.arange(FRAMES) / 30.0
    q = np.tile(g1.default_qpos, (FRAMES, 1))
    q[:, 3:7] = rot.from_yaw(0.9 + 0.4 * t)
    for k, joint in enumerate(
        ("left_shoulder_pitch", "right_elbow", "waist_yaw", "right_shoulder_roll", "left_wrist_roll")
    ):
        q[:, 7 + g1.joint(f"{joint}_joint")] += (
            (0.3 + 0.1 * k) * np.sin(2 * t + k) ** 2 * (-1.0 if "roll" in joint else 1.0)
        )
    return q


def read(g1, q, *, quat=None, order=None, options=None, **fields):
    given = {"dialect": "d", "fps": 30.0, "robot": "g1", "joint_names": g1.joint_names, "root_pos": q[:, :3],
             "root_quat": q[:, 3:7] if quat is None else quat, "joint_pos": q[:, 7:]}  # fmt: skip
    return robot_clip(RAW, quat_order=order, options=options or ReadOptions(), **(given | fields))


def found(clip, what):
    return next(f for f in clip.source.findings if f.what == what)


@pytest.mark.parametrize("name", [n for n in robot_names() if installed(n)])
def test_breadth_first_is_every_joint_once_and_siblings_in_the_files_order(name):
    robot = load_robot(name)
    order = breadth_first(robot)
    assert sorted(order) == sorted(robot.joint_names)
    m, places = robot.model, []
    for joint in order:
        body, depth = int(m.jnt_bodyid[m.joint(joint).id]), 0
        while body:
            body, depth = int(m.body_parentid[body]), depth + 1
        places.append((depth, int(m.jnt_bodyid[m.joint(joint).id])))
    assert places == sorted(places)  # of one depth, MuJoCo numbers bodies as the file has them


def test_full_qpos_puts_every_joint_at_its_own_place_and_the_rest_at_the_default(g1, rng):
    some = rng.permutation(len(g1.joint_names))[:12]
    clip = RobotClip(
        fps=30.0, robot="g1", joint_names=tuple(g1.joint_names[i] for i in some), root_pos=tagged(9, 3),
        root_quat=rot.from_yaw(np.arange(9.0)), joint_pos=tagged(9, 12), source=SOURCE,
    )  # fmt: skip
    q = full_qpos(clip, g1)
    for place, joint in enumerate(some):
        np.testing.assert_array_equal(q[:, 7 + joint], 100 * place + np.arange(9))
    rest = np.setdiff1d(np.arange(len(g1.joint_names)), some)
    np.testing.assert_array_equal(q[:, 7 + rest], np.tile(g1.default_joint_pos[rest], (9, 1)))
    np.testing.assert_array_equal(q[:, :7], np.concatenate((clip.root_pos, clip.root_quat), axis=1))


def test_layouts_are_the_robots_and_variants_with_that_many_joints(g1):
    for robot, names in layouts(29, None):
        assert len(names) == 29 and set(names) <= set(load_robot(robot).joint_names)
    whole, fewer = layouts(29, "g1"), layouts(23, "g1")
    assert whole == [("g1", g1.joint_names)] and fewer
    for _, names in fewer:  # a variant lacks joints and changes no order
        assert [n for n in g1.joint_names if n in names] == list(names)
    assert layouts(29, "dancer") == [] and layouts(3, None) == []


def test_a_number_of_joints_that_one_robot_has_names_it_and_any_other_is_refused(g1):
    def joints(count):
        return NamelessMotion(root_pos=np.zeros((9, 3)), root_quat=np.ones((9, 4)) / 2, joint_pos=np.zeros((9, count)))

    robot, names, finding = choose_layout(RAW, joints(28), ReadOptions(source_robot="dancer"))
    assert (robot, len(names), finding.confidence) == ("dancer", 28, "stated")
    with pytest.raises(ClipError, match=r"7 joint values per frame.*dancer 28.*g1 29") as refusal:
        choose_layout(RAW, joints(7), ReadOptions())
    assert refusal.value.option == "source_robot"
    with pytest.raises(ClipError, match="28 joint values"):
        choose_layout(RAW, joints(28), ReadOptions(source_robot="g1"))


@pytest.mark.parametrize("heading", [0.0, 1.5, 3.0])
@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
def test_the_quaternion_order_is_found_wherever_the_robot_stands_and_whichever_way_it_faces(g1, sway, heading, order):
    turn = np.tile(rot.from_yaw(np.array(heading)), (FRAMES, 1))
    q = sway.copy()
    q[:, :3] = rot.rotate(turn, q[:, :3]) + [5.0, -3.0, 0.0]
    q[:, 3:7] = rot.multiply(turn, q[:, 3:7])
    clip = read(g1, q, quat=q[:, 3:7] if order == "wxyz" else rot.to_quat_xyzw(q[:, 3:7]))
    assert (found(clip, "quaternion order").value, found(clip, "quaternion order").confidence) == (order, "measured")
    assert rot.angle_between(clip.root_quat, q[:, 3:7]).max() < 1e-7


def test_what_a_format_says_is_believed_and_what_is_only_its_custom_may_be_overruled(g1, sway):
    crossed = rot.to_quat_xyzw(sway[:, 3:7])
    assert found(read(g1, sway, quat=crossed, order="xyzw"), "quaternion order").confidence == "stated"
    assert found(read(g1, sway, quat=crossed, customary_order="wxyz"), "quaternion order").value == "xyzw"
    stated = read(g1, sway, quat=crossed, order="wxyz", options=ReadOptions(quat_order="xyzw"))  # the user above all
    assert rot.angle_between(stated.root_quat, sway[:, 3:7]).max() < 1e-7
    # Scalar last read as scalar first: who faces back at half a turn is laid on the head.
    back = rot.to_quat_xyzw(rot.multiply(np.tile(rot.from_yaw(np.array(1.9)), (FRAMES, 1)), sway[:, 3:7]))
    with pytest.raises(ClipError, match="a robot on its feet") as refusal:
        read(g1, sway, quat=back, order="wxyz")
    assert (refusal.value.option, refusal.value.suggestion) == ("quat_order", "xyzw")


def test_flipped_signs_are_mended_and_counted(g1, sway, rng):
    signs = rng.choice([-1.0, 1.0], size=(FRAMES, 1))
    clip = read(g1, sway, quat=signs * sway[:, 3:7], order="wxyz")
    assert [r.count for r in clip.source.repairs] == [int((np.diff(signs[:, 0]) != 0).sum())]
    assert (np.sum(clip.root_quat[1:] * clip.root_quat[:-1], axis=1) > 0).all()


@pytest.mark.parametrize("turns", [1, -1])
def test_whole_turns_are_taken_out_of_the_joint_that_has_them(g1, sway, turns):
    q, joint = sway.copy(), g1.joint("waist_yaw_joint")
    q[:, 7 + joint] += 2 * np.pi * turns
    clip = read(g1, q, order="wxyz")
    np.testing.assert_allclose(clip.joint_pos, sway[:, 7:], atol=1e-12)
    (repair,) = clip.source.repairs
    assert repair.count == FRAMES and repair.what.endswith("waist_yaw_joint")


def test_a_jump_by_a_turn_in_mid_clip_is_unwrapped(g1, sway):
    q, joint = sway.copy(), g1.joint("left_wrist_roll_joint")
    q[35:, 7 + joint] -= 2 * np.pi
    clip = read(g1, q, order="wxyz")
    np.testing.assert_allclose(clip.joint_pos, sway[:, 7:], atol=1e-12)
    assert clip.source.repairs[0].count == FRAMES - 35


def test_the_joint_order_is_measured_unless_it_is_stated(g1, sway):
    isaac = [g1.joint(n) for n in breadth_first(g1)]

    def order(columns, **options):
        return joint_order(RAW, "g1", g1.joint_names, sway[:, :3], sway[:, 3:7], columns, ReadOptions(**options))

    assert order(sway[:, 7:])[0] == g1.joint_names
    names, finding = order(sway[:, 7:][:, isaac])
    assert (names, finding.value, finding.confidence) == (breadth_first(g1), "isaac", "measured")
    names, finding = order(sway[:, 7:], joint_order="isaac")  # even where it is wrong
    assert (names, finding.confidence) == (breadth_first(g1), "stated")


@pytest.mark.parametrize("options", [{"unit": "cm"}, {"up": "y"}])
def test_options_that_a_robots_file_cannot_obey_are_refused(g1, sway, options):
    with pytest.raises(ClipError, match=r"option (unit|up): found a robot's own file") as refusal:
        read(g1, sway, order="wxyz", options=ReadOptions(**options))
    assert refusal.value.option == next(iter(options))
    read(g1, sway, order="wxyz", options=ReadOptions(unit="m", up="z"))  # what is so anyhow may be said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda q: np.concatenate((100 * q[:, :3], q[:, 3:]), axis=1), "centimetres or millimetres"),
        (lambda q: np.concatenate((q[:, :3], 0.5 * q[:, 3:7], q[:, 7:]), axis=1), "frame 0: found root quaternion of length 0.5"),
        (lambda q: np.concatenate((q[:, :7], np.degrees(q[:, 7:])), axis=1), "expected radians"),
        (lambda q: q + np.eye(36)[2] * 0.6, "soles 0.6.* m over the floor"),
        (lambda q: q + 0.8 * (np.arange(36) >= 7), "outside g1's limits"),
    ],
    ids=["cm", "short", "degrees", "hovering", "limits"],
)  # fmt: skip
def test_numbers_that_are_no_robots_are_refused(g1, sway, change, said):
    with pytest.raises(ClipError, match=said):
        read(g1, change(sway), order="wxyz")
