"""References: velocities are the motion's, MuJoCo agrees on them, and numbers that contradict the robot are refused."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from clips import ReferenceFileError, check_reference_against, load_reference, make_reference, save_reference
from robot_models import PART_NAMES, load_robot
from robot_models.maths import rotation as rot


def motion(robot, fps=50.0, seconds=1.0):
    """The root flies along a curve and tumbles; every joint swings in its own way."""
    t = np.arange(round(seconds * fps) + 1)[:, None] / fps
    k = np.arange(len(robot.joint_names))
    middle, half = 0.5 * (robot.lower + robot.upper), 0.2 * (robot.upper - robot.lower)
    root = np.concatenate((t, np.sin(2 * t), 0.8 + 0.1 * np.cos(3 * t)), axis=1)
    turn = rot.exp(np.concatenate((np.sin(t), 0.5 * t, np.cos(2 * t)), axis=1))
    return np.concatenate((root, rot.continuous(turn), middle + half * np.sin((1 + 0.1 * k) * t + k)), axis=1)


def made(robot, qpos, fps=50.0, **meta):
    segments = np.array(meta.pop("segments", [[0, len(qpos), 0]]))
    return make_reference(robot, qpos, fps, contact=np.zeros((len(qpos), 4), dtype=int), segments=segments, meta=meta)


@pytest.fixture
def reference(dancer):
    return made(dancer, motion(dancer))


def saved(path, reference, **changes):
    """The reference's file, with arrays of it exchanged; None takes one out."""
    save_reference(reference, path)
    with np.load(path) as data:
        arrays = {k: data[k] for k in data.files} | changes
    np.savez(path, **{k: v for k, v in arrays.items() if v is not None})
    return path


def test_qpos_is_what_it_was_made_of_and_the_duration_lies_between_the_first_and_the_last_frame(dancer, reference):
    np.testing.assert_allclose(reference.qpos, motion(dancer), atol=1e-12)
    assert (reference.frames, reference.duration_s) == (51, 1.0)


def test_mujoco_moves_its_bodies_as_the_reference_says_to_second_order(dancer):
    misses = []
    for fps in (25.0, 50.0, 100.0):
        r, data = made(dancer, motion(dancer, fps), fps), mujoco.MjData(dancer.model)
        worst = 0.0
        for t in range(1, r.frames - 1, round(fps / 25)):
            data.qpos[:], data.qvel[:] = r.qpos[t], r.qvel[t]
            mujoco.mj_forward(dancer.model, data)
            for i, body in enumerate(dancer.body_ids):
                twist = np.zeros(6)
                mujoco.mj_objectVelocity(dancer.model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
                worst = max(worst, np.abs(twist - [*r.body_ang_vel_w[t, i], *r.body_lin_vel_w[t, i]]).max())
        misses.append(worst)
    # Both are central differences, of angles and of places: they part with the square of the step.
    np.testing.assert_allclose(np.divide(misses[:-1], misses[1:]), 4.0, rtol=0.15)


def test_a_step_along_qvel_leads_to_the_next_frame_to_second_order(dancer):
    misses = []
    for fps in (50.0, 100.0, 200.0):
        r = made(dancer, motion(dancer, fps), fps)
        worst = 0.0
        for t in range(1, r.frames - 1):
            step = np.array(r.qpos[t])
            mujoco.mj_integratePos(dancer.model, step, np.array(r.qvel[t]), 1.0 / fps)
            worst = max(
                worst, np.abs(step[7:] - r.qpos[t + 1, 7:]).max(), rot.angle_between(step[3:7], r.qpos[t + 1, 3:7])
            )
        misses.append(worst)
    np.testing.assert_allclose(np.divide(misses[:-1], misses[1:]), 4.0, rtol=0.15)


def test_played_backwards_every_velocity_is_the_opposite(dancer, reference):
    back = made(dancer, reference.qpos[::-1].copy())
    for name in ("joint_vel", "body_lin_vel_w", "body_ang_vel_w"):
        np.testing.assert_allclose(getattr(back, name)[::-1], -getattr(reference, name), atol=1e-9)


def test_twice_the_rate_is_twice_the_speed(dancer, reference):
    quick = made(dancer, reference.qpos.copy(), fps=100.0)
    np.testing.assert_allclose(quick.joint_vel, 2 * reference.joint_vel, atol=1e-9)
    np.testing.assert_allclose(quick.qvel, 2 * reference.qvel, atol=1e-9)
    assert quick.duration_s == pytest.approx(0.5 * reference.duration_s)


def test_the_dance_is_what_lies_between_its_leads_and_everything_without_names(dancer):
    q = motion(dancer)
    rows = [[0, 10, 0], [10, 20, 1], [20, 30, 1], [30, 40, 1], [40, 51, 1]]
    names = ["lead-in", "dance", "bridge", "dance", "lead-out"]
    assert made(dancer, q, segments=rows, segment_names=names).dance == slice(10, 40)
    assert made(dancer, q, segments=rows[:2], segment_names=["lead-in", "dance"]).dance == slice(10, 20)
    assert made(dancer, q).dance == slice(0, 51)


@pytest.mark.parametrize("name", ["joint_pos", "body_quat_w", "body_ang_vel_w"])
def test_numbers_that_are_not_finite_are_refused_by_the_arrays_name(reference, name):
    bad = getattr(reference, name).copy()
    bad[3] = np.nan
    with pytest.raises(ReferenceFileError, match=f"reference, {name}"):
        replace(reference, **{name: bad})


def swapped(array, a, b, axis=1):
    order = np.arange(array.shape[axis])
    order[[a, b]] = order[[b, a]]
    return np.take(array, order, axis=axis)


def tilted(quat, body, angle):
    out = quat.copy()
    out[:, body] = rot.multiply(quat[:, body], np.tile(rot.exp(np.array([angle, 0.0, 0.0])), (len(quat), 1)))
    return out


@pytest.mark.parametrize(
    "change",
    [
        lambda r: {"joint_pos": swapped(r.joint_pos, 3, 9)},
        lambda r: {"joint_pos": np.degrees(r.joint_pos)},
        lambda r: {"body_pos_w": swapped(r.body_pos_w, 3, 9)},
        lambda r: {"body_pos_w": 100.0 * r.body_pos_w},
        lambda r: {"body_quat_w": r.body_quat_w[..., [1, 2, 3, 0]]},
        lambda r: {"body_quat_w": r.body_quat_w * [1.0, -1.0, -1.0, -1.0]},
        lambda r: {"body_quat_w": tilted(r.body_quat_w, 20, 1e-6)},
        lambda r: {"body_pos_w": np.roll(r.body_pos_w, 1, axis=0)},
    ],
    ids=["joints", "degrees", "bodies", "centimetres", "xyzw", "inverse", "one body turned", "a frame late"],
)
def test_numbers_in_another_order_unit_or_time_contradict_the_kinematics(dancer, reference, change):
    check_reference_against(reference, dancer, "here")
    with pytest.raises(ReferenceFileError, match="here: found bodies .* away from the forward kinematics"):
        check_reference_against(replace(reference, **change(reference)), dancer, "here")


def test_the_sign_of_a_stored_quaternion_contradicts_nothing(dancer, reference):
    check_reference_against(replace(reference, body_quat_w=-reference.body_quat_w), dancer, "here")


def test_torques_are_kept_where_there_are_any(reference, tmp_path):
    torque = reference.joint_vel * 3.0
    save_reference(replace(reference, joint_torque=torque), tmp_path / "t.npz")
    np.testing.assert_array_equal(load_reference(tmp_path / "t.npz").joint_torque, torque)
    save_reference(reference, tmp_path / "n.npz")
    assert load_reference(tmp_path / "n.npz").joint_torque is None


def test_parts_on_the_floor_are_kept_and_files_of_dances_on_two_feet_have_none(reference, tmp_path):
    parts = np.zeros((reference.frames, len(PART_NAMES)), dtype=np.int8)
    parts[3:9, PART_NAMES.index("left_knee")] = 1
    save_reference(replace(reference, part_contact=parts), tmp_path / "p.npz")
    np.testing.assert_array_equal(load_reference(tmp_path / "p.npz").part_contact, parts)
    save_reference(reference, tmp_path / "n.npz")
    assert load_reference(tmp_path / "n.npz").part_contact is None
    assert not {"part_contact", "part_names"} & set(np.load(tmp_path / "n.npz").files)
    arrays = dict(np.load(tmp_path / "p.npz"))
    for broken in (
        {"part_names": np.array(PART_NAMES[::-1])}, {"part_contact": parts + 7},
        {"part_contact": parts[:, 1:]}, {"part_contact": parts * 1.0}, {"part_contact": np.array(1)},
    ):  # fmt: skip
        np.savez(tmp_path / "b.npz", **arrays | broken)
        with pytest.raises(ReferenceFileError, match="part_"):
            load_reference(tmp_path / "b.npz")
    arrays.pop("part_names")
    np.savez(tmp_path / "b.npz", **arrays)
    with pytest.raises(ReferenceFileError, match="part_names"):
        load_reference(tmp_path / "b.npz")


def test_what_was_noted_comes_back_and_what_every_file_states_is_not_noted_twice(dancer, tmp_path):
    meta = {"title": "Tänze 舞", "numbers": [1, 2.5, None], "deep": {"a": [True]}}
    save_reference(made(dancer, motion(dancer), **meta), tmp_path / "m.npz")
    again = load_reference(tmp_path / "m.npz")
    assert again.meta == meta and again.robot == "dancer"
    save_reference(again, tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "m.npz").read_bytes()


@pytest.mark.parametrize("key", ["fps", "joint_vel", "segments", "contact_names", "meta"])
def test_a_missing_key_is_refused_by_name(reference, tmp_path, key):
    with pytest.raises(ReferenceFileError, match=f"no key {key}"):
        load_reference(saved(tmp_path / "r.npz", reference, **{key: None}))


def test_what_is_no_reference_is_refused(reference, tmp_path):
    with pytest.raises(ReferenceFileError, match="no such file"):
        load_reference(tmp_path / "no.npz")
    (tmp_path / "text.npz").write_text("hello")
    with pytest.raises(ReferenceFileError, match="broken archive"):
        load_reference(tmp_path / "text.npz")
    other = np.array(["right_heel", "right_toe", "left_heel", "left_toe"])
    with pytest.raises(ReferenceFileError, match="contact names"):
        load_reference(saved(tmp_path / "r.npz", reference, contact_names=other))


def test_another_robots_reference_is_refused_by_names_that_it_lacks(dancer, reference):
    with pytest.raises(ReferenceFileError, match=r"not g1's \(left_hip_yaw.*29 joints and 30 bodies"):
        check_reference_against(reference, load_robot("g1"), "here")
