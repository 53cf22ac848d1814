"""What is written in another tool's layout is what that tool reads: by our readers, and by the layout's own rules."""

import pickle

import joblib
import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, ReadOptions, RobotClip, full_qpos, make_reference, read_clip, save_reference
from clips.edit import resample
from clips.writers import LAYOUTS, write_motion
from robot_models import forward_kinematics, load_robot
from robot_models.maths import rotation as rot


@pytest.fixture(scope="module")
def g1():
    return load_robot("g1")


@pytest.fixture
def clip(g1, tmp_path):
    """A G1 that sways and turns, as a reference of ours."""
    t = np.arange(120) / 60
    qpos = np.tile(g1.default_qpos, (120, 1))
    qpos[:, 0] += 0.2 * t
    qpos[:, 3:7] = rot.from_euler(np.stack((0.8 + 0.3 * np.sin(t), 0.05 * np.cos(t), 0.04 * t), axis=1), "ZYX")
    qpos[:, 7:] += 0.2 * np.sin(3 * t[:, None] + np.arange(29))
    qpos[:, 7:] = np.clip(qpos[:, 7:], g1.lower + 0.01, g1.upper - 0.01)
    made = make_reference(
        g1, qpos, 60.0, contact=np.zeros((120, 4), dtype=int), segments=np.array([[0, 120, 0]]), meta={}
    )
    save_reference(made, tmp_path / "sway.npz")
    return read_clip(tmp_path / "sway.npz")


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_reads_back_by_its_own_rules(layout, clip, g1, tmp_path):
    path = tmp_path / f"out{LAYOUTS[layout].suffix}"
    written = write_motion(path, layout, clip, g1)
    # No help but the rate where a layout never says it: orders are found from the content.
    again = read_clip(path, ReadOptions(fps=30.0 if layout == "unitree-csv" else None))
    assert isinstance(again, RobotClip) and again.robot == "g1" and again.fps == written.fps
    got, meant = full_qpos(again, g1), full_qpos(resample(clip, written.fps), g1)
    np.testing.assert_allclose(got[:, :3], meant[:, :3], atol=1e-6)
    np.testing.assert_allclose(got[:, 7:], meant[:, 7:], atol=1e-6)
    assert rot.angle_between(got[:, 3:7], meant[:, 3:7]).max() < 1e-5


def test_the_csv_is_thirty_hertz_because_its_readers_take_that_for_granted(clip, g1, tmp_path):
    assert write_motion(tmp_path / "a.csv", "unitree-csv", clip, g1).fps == 30.0
    rows = np.loadtxt(tmp_path / "a.csv", delimiter=",")
    assert rows.shape == (60, 36)
    with pytest.raises(ClipError, match="30"):
        write_motion(tmp_path / "b.csv", "unitree-csv", clip, g1, fps=50.0)
    assert not (tmp_path / "b.csv").exists()


def test_pickles_are_plain_and_have_their_readers_keys(clip, g1, tmp_path):
    write_motion(tmp_path / "a.pkl", "gmr", clip, g1, fps=50.0)
    told = pickle.loads((tmp_path / "a.pkl").read_bytes())
    assert set(told) == {"fps", "root_pos", "root_rot", "dof_pos", "local_body_pos", "link_body_list"}
    assert told["fps"] == 50 and isinstance(told["fps"], int)
    qpos = full_qpos(resample(clip, 50.0), g1)
    np.testing.assert_allclose(told["root_rot"][:, 3], qpos[:, 3], atol=1e-12)  # w is last
    write_motion(tmp_path / "dance.pkl", "phc", clip, g1)
    (name, told), *more = joblib.load(tmp_path / "dance.pkl").items()
    assert name == "dance" and not more and told["pose_aa"].shape == (120, 30, 3)
    knee = g1.joint("left_knee_joint")
    np.testing.assert_allclose(
        np.linalg.norm(told["pose_aa"][:, 1 + knee], axis=1), np.abs(told["dof"][:, knee]), atol=1e-12
    )


@pytest.mark.parametrize("layout", ["mujoco-npz", "isaac-npz"])
def test_motion_npz_has_its_engines_order_and_velocities(layout, clip, g1, tmp_path):
    write_motion(tmp_path / "m.npz", layout, clip, g1)
    with np.load(tmp_path / "m.npz") as file:
        data = dict(file)
    assert data["fps"].shape == (1,) and data["joint_pos"].dtype == np.float32
    assert {k: v.shape[1:] for k, v in data.items() if k != "fps"} == {
        "joint_pos": (29,), "joint_vel": (29,), "body_pos_w": (30, 3), "body_quat_w": (30, 4),
        "body_lin_vel_w": (30, 3), "body_ang_vel_w": (30, 3),
    }  # fmt: skip
    qpos = full_qpos(clip, g1)
    pos, quat = forward_kinematics(g1, qpos)
    if layout == "mujoco-npz":
        np.testing.assert_allclose(data["body_pos_w"], pos, atol=1e-5)
        return
    # The facts of Isaac's order: these come first, and body i + 1 hangs on joint i.
    first = [
        "left_hip_pitch_joint",
        "right_hip_pitch_joint",
        "waist_yaw_joint",
        "left_hip_roll_joint",
        "right_hip_roll_joint",
    ]
    np.testing.assert_allclose(data["joint_pos"][:, :5], qpos[:, [7 + g1.joint(j) for j in first]], atol=1e-6)
    np.testing.assert_allclose(data["body_pos_w"][:, 9], pos[:, g1.body("torso_link")], atol=1e-5)
    # Velocity of the centre of mass: the derivative of where it is.
    torso = g1.body("torso_link")
    com = pos[:, torso] + rot.rotate(quat[:, torso], np.array(g1.model.body_ipos[g1.body_ids[torso]]))
    np.testing.assert_allclose(data["body_lin_vel_w"][1:-1, 9], (com[2:] - com[:-2]) * 30.0, atol=2e-3)


def test_an_unknown_layout_is_refused(clip, g1, tmp_path):
    with pytest.raises(ClipError, match="unitree-csv, gmr"):
        write_motion(tmp_path / "a", "fbx", clip, g1)


def test_the_command_converts_reads_back_and_refuses_a_person(tmp_path, clip, capsys):
    import cli.convert

    source = tmp_path / "sway.npz"
    assert cli.convert.main([str(source), "--to", "gmr"]) == 0
    assert "read back to" in capsys.readouterr().out and (tmp_path / "sway_gmr.pkl").exists()
    assert cli.convert.main([str(SAMPLES / "groove.bvh"), "--to", "gmr"]) == 2
    assert "retarget it first" in capsys.readouterr().err


def test_verify_knows_a_reference_its_source_and_a_change_of_either(tmp_path, groove, capsys):
    import shutil

    import cli.verify

    save_reference(groove.reference, tmp_path / "g.npz")
    assert cli.verify.main([str(tmp_path / "g.npz")]) == 0
    assert "not here" in capsys.readouterr().out
    shutil.copy(SAMPLES / "groove.bvh", tmp_path)
    assert cli.verify.main([str(tmp_path / "g.npz")]) == 0
    assert "is what it was made from" in capsys.readouterr().out
    (tmp_path / "groove.bvh").write_bytes((SAMPLES / "groove.bvh").read_bytes() + b"\n")
    assert cli.verify.main([str(tmp_path / "g.npz")]) == 1
    with np.load(tmp_path / "g.npz") as file:
        data = dict(file)
    data["joint_pos"] = data["joint_pos"] + 0.01
    np.savez(tmp_path / "bent.npz", **data)
    assert cli.verify.main([str(tmp_path / "bent.npz")]) == 2
    assert "forward kinematics" in capsys.readouterr().err


def test_the_doctor_names_what_is_missing_and_the_line_that_installs_it(monkeypatch, capsys):
    import cli.doctor

    assert cli.doctor.main([]) == 0
    out = capsys.readouterr().out
    assert "robot dancer" in out and "28 joints" in out and "threads" in out
    real = cli.doctor.version

    def gone(name):
        if name == "mujoco":
            raise cli.doctor.PackageNotFoundError(name)
        return real(name)

    monkeypatch.setattr(cli.doctor, "version", gone)
    assert cli.doctor.main([]) == 1
    out = capsys.readouterr().out
    assert "mujoco missing" in out and "pip install" in out
