"""Clips and references as types: checked at the door, kept by files, resampled by time."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, OutputError, ReferenceFileError, cut, load_reference, read_clip, save_reference
from clips.edit import resample
from clips.edit.align import recentre
from robot_models import load_robot
from robot_models.maths import rotation as rot


@pytest.fixture(scope="module")
def clip():
    return read_clip(SAMPLES / "groove.bvh")


def test_a_clip_cannot_be_changed(clip):
    with pytest.raises(ValueError, match="read-only"):
        clip.positions[0, 0, 0] = 1.0


def test_a_clip_with_one_bad_number_is_refused(clip):
    bad = clip.positions.copy()
    bad[17, 3, 1] = np.nan
    with pytest.raises(ClipError, match="frame 17"):
        dataclasses.replace(clip, positions=bad)


@pytest.mark.parametrize("fps", [24.0, 29.876, 50.0, 60.0, 120.0])
def test_resampling_keeps_the_duration_to_one_frame(clip, fps):
    new = resample(clip, fps)
    assert abs((new.frames - 1) / fps - (clip.frames - 1) / clip.fps) <= 1.0 / fps
    np.testing.assert_allclose(new.positions[0], clip.positions[0], atol=1e-12)


def test_resampling_there_and_back_returns_the_motion(clip):
    smooth = dataclasses.replace(clip, positions=clip.positions * 0 + np.sin(np.arange(601) / 60)[:, None, None])
    back = resample(resample(smooth, 120.0), 60.0)
    np.testing.assert_allclose(back.positions, smooth.positions, atol=1e-6)
    assert rot.angle_between(back.orientations, smooth.orientations).max() < 1e-6


def test_slerp_resampling_converges_at_second_order():
    errors = []
    for fps in (20, 40, 80):
        t = np.arange(2 * fps + 1) / fps
        q = rot.exp(np.stack((np.sin(2 * t), 0.5 * np.cos(t), 0 * t), axis=1))
        from clips.edit.resample import sample_quat

        middle = np.arange(2 * fps) + 0.5
        exact = middle / fps
        truth = rot.exp(np.stack((np.sin(2 * exact), 0.5 * np.cos(exact), 0 * exact), axis=1))
        errors.append(rot.angle_between(sample_quat(q, middle), truth).max())
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.25) and errors[1] / errors[2] == pytest.approx(4, rel=0.25)


def test_recentring_is_rigid_and_faces_forward(clip):
    moved = recentre(clip)
    d = [np.linalg.norm(c.point("left_wrist") - c.point("right_ankle"), axis=1) for c in (clip, moved)]
    np.testing.assert_allclose(d[0], d[1], atol=1e-12)
    left = moved.point("left_hip")[0] - moved.point("right_hip")[0]
    assert abs(left[0]) < 1e-9 and left[1] > 0
    np.testing.assert_allclose(moved.point("pelvis")[0, :2], 0, atol=1e-12)
    np.testing.assert_array_equal(moved.positions[..., 2], clip.positions[..., 2])


def test_cutting_is_by_seconds(clip):
    part = cut(clip, 2.0, 4.0)
    assert part.frames == 121
    np.testing.assert_array_equal(part.positions[0], clip.positions[120])


def test_a_reference_comes_back_bit_for_bit(groove, groove_file):
    loaded = load_reference(groove_file, load_robot("dancer"))
    for f in dataclasses.fields(groove.reference):
        a, b = getattr(groove.reference, f.name), getattr(loaded, f.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(a, b)
    assert loaded.meta["segment_names"] == ["lead-in", "dance", "lead-out"]


def test_the_same_clip_gives_the_same_bytes(groove_file, tmp_path):
    from retarget import retarget

    again = retarget(cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 4.0), load_robot("dancer"))
    save_reference(again.reference, tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == groove_file.read_bytes()


def test_single_precision_is_half_the_size_and_still_checked(groove, groove_file, tmp_path):
    save_reference(groove.reference, tmp_path / "f.npz", float32=True)
    assert (tmp_path / "f.npz").stat().st_size < 0.6 * groove_file.stat().st_size
    load_reference(tmp_path / "f.npz", load_robot("dancer"))


def test_the_first_seven_keys_are_mjlabs(groove_file):
    with np.load(groove_file, allow_pickle=False) as data:
        assert data.files[:7] == [
            "fps", "joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w"
        ]  # fmt: skip
        assert data["fps"].shape == (1,)


def tampered(path, out, **changes):
    with np.load(path, allow_pickle=False) as data:
        arrays = {k: data[k] for k in data.files} | changes
    np.savez(out, **arrays)
    return out


def test_tampered_references_are_refused(groove, groove_file, tmp_path):
    robot, out = load_robot("dancer"), tmp_path / "t.npz"
    pos = np.array(groove.reference.body_pos_w)
    pos[40, 5, 0] += 1e-6
    with pytest.raises(ReferenceFileError, match="forward kinematics"):
        load_reference(tampered(groove_file, out, body_pos_w=pos), robot)
    names = np.array(groove.reference.joint_names)[::-1]
    with pytest.raises(ReferenceFileError, match="names or order"):
        load_reference(tampered(groove_file, out, joint_names=names), robot)
    meta = str(np.load(groove_file)["meta"]).replace('"format_version": 2', '"format_version": 99')
    with pytest.raises(ReferenceFileError, match="version 99"):
        load_reference(tampered(groove_file, out, meta=np.array(meta)), robot)
    meta = str(np.load(groove_file)["meta"]).replace(robot.hash, "0" * 64)
    with pytest.raises(ReferenceFileError, match="robot hash"):
        load_reference(tampered(groove_file, out, meta=np.array(meta)), robot)


def test_velocities_are_those_of_the_stored_curve(groove):
    r = groove.reference
    dt = 1.0 / r.fps
    np.testing.assert_allclose(r.joint_vel[1:-1], (r.joint_pos[2:] - r.joint_pos[:-2]) / (2 * dt), atol=1e-9)
    np.testing.assert_allclose(r.body_lin_vel_w[1:-1], (r.body_pos_w[2:] - r.body_pos_w[:-2]) / (2 * dt), atol=1e-9)
    turn = rot.log(rot.multiply(r.body_quat_w[2:], rot.conjugate(r.body_quat_w[:-2]))) / (2 * dt)
    np.testing.assert_allclose(r.body_ang_vel_w[1:-1], turn, atol=1e-9)


def test_qvel_has_the_root_spin_in_the_body_frame(groove):
    import mujoco

    robot, r = load_robot("dancer"), groove.reference
    t = r.frames // 2
    q, v = r.qpos[t], r.qvel[t]
    step = q.copy()
    mujoco.mj_integratePos(robot.model, step, v, 1.0 / r.fps)
    assert rot.angle_between(step[3:7], r.qpos[t + 1, 3:7]) < 0.01


def test_an_output_is_whole_or_absent(tmp_path):
    from clips.files import write_whole

    path = tmp_path / "out.bin"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError), write_whole(path) as stream:
        stream.write(b"half")
        raise RuntimeError
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OutputError, match="takes no file"), write_whole(tmp_path / "no" / "out.bin"):
        pass


@pytest.mark.parametrize("start, end", [(-1.0, None), (0.0, -1.0), (3.0, 2.0), (99.0, None), (float("nan"), None)])
def test_a_cut_outside_the_clip_is_refused(clip, start, end):
    with pytest.raises(ClipError, match="inside the clip"):
        cut(clip, start, end)


def test_arrays_of_another_shape_are_refused_outside_the_test_run_too():
    code = (
        "import dataclasses, clips;"
        f"clip = clips.read_clip({str(SAMPLES / 'groove.bvh')!r});"
        "dataclasses.replace(clip, orientations=clip.orientations[:10])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=SAMPLES.parent.parent)
    assert "ClipError" in run.stderr and "orientations of shape (10, 21, 4)" in run.stderr
