"""The rehearsal's robot: the servo law at every physics step, sensors with their noise, and nothing of the robot changed."""

import mujoco
import numpy as np
import pytest

from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.deploy.rehearsal.robot import STATE_DT, SensorNoise, SimulatedBody, _torque_model, sensed


@pytest.fixture(scope="module")
def robot():
    return load_robot("g1")


def lifted(robot, height=2.0):
    body = SimulatedBody(robot)
    body._data.qpos[2] += height
    mujoco.mj_forward(body._model, body._data)
    return body


def test_the_robot_itself_keeps_its_servos(robot):
    before = [getattr(robot.model, k).copy() for k in ("actuator_gainprm", "actuator_biasprm")]
    dt = robot.model.opt.timestep
    model = _torque_model(robot)
    for kept, now in zip(before, (robot.model.actuator_gainprm, robot.model.actuator_biasprm), strict=True):
        np.testing.assert_array_equal(kept, now)
    assert robot.model.opt.timestep == dt and model.nu == robot.model.nu


def test_its_motors_give_the_torque_that_they_are_asked_for(robot, rng):
    model = _torque_model(robot)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[6:] = robot.default_qpos, rng.normal(size=29)
    data.ctrl[:] = 0.9 * robot.effort * rng.uniform(-1.0, 1.0, size=29)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_actuator[6:], data.ctrl)  # whatever the pose and the speed


def test_one_step_is_a_state_period_and_poses_are_copies(robot):
    body = lifted(robot)
    began, pose = body._data.time, body.qpos
    body.step(robot.kp, robot.kd, robot.default_joint_pos)
    assert body._data.time - began == pytest.approx(STATE_DT)
    assert (body.qpos != pose).any()
    pose[:] = 0.0
    assert body.qpos[3] != 0.0


def test_in_the_air_its_servo_law_moves_as_mujocos_own_servos_do(robot):
    """Two roads to one motion: torques computed here, and MuJoCo's position servos on the same robot."""
    ours, theirs = lifted(robot), mujoco.MjData(robot.model)
    theirs.qpos[:] = ours.qpos
    target = robot.default_joint_pos + 0.1 * np.sin(np.arange(29))
    theirs.ctrl[:] = target
    model = robot.model
    steps = round(STATE_DT / model.opt.timestep * 20)
    for _ in range(20):
        ours.step(robot.kp, robot.kd, target)
    for _ in range(steps):
        mujoco.mj_step(model, theirs)
    moved = np.abs(ours.qpos[7:] - robot.default_joint_pos).max()
    assert moved > 0.02  # they have gone a good part of the way
    # The two integrate the same servo with steps of another length and kind: a few per cent in 40 ms.
    np.testing.assert_allclose(ours.qpos[7:], theirs.qpos[7:], atol=0.1 * moved)


def test_no_servo_pulls_harder_than_its_motor(robot):
    body = lifted(robot)
    body.step(robot.kp, robot.kd, robot.default_joint_pos + 100.0)
    np.testing.assert_allclose(body._data.ctrl, robot.effort)
    body.step(robot.kp, robot.kd, robot.default_joint_pos - 100.0)
    np.testing.assert_allclose(body._data.ctrl, -robot.effort)


def test_damping_takes_energy_and_asks_for_no_pose(robot):
    body = lifted(robot)
    body._data.qvel[6:] = 2.0 * np.sin(np.arange(29))
    far = robot.default_joint_pos + 50.0  # a target that no gain listens to
    speeds = []
    for _ in range(10):
        speeds.append(np.abs(body.qvel[6:]).mean())
        body.step(np.zeros(29), 5.0 * robot.kd, far)
    assert speeds[-1] < 0.5 * speeds[0]


def test_sensors_tell_the_state_within_their_noise_and_the_seed_decides(robot):
    body, noise = SimulatedBody(robot), SensorNoise()
    body._data.qvel[:] = np.linspace(-1.0, 1.0, 35)
    told = [sensed(body, np.random.default_rng(k)) for k in range(30)]
    q, v = body.qpos, body.qvel
    turns = rot.angle_between(np.array([t.quat for t in told]), np.tile(q[3:7], (30, 1)))
    assert 0.0 < turns.max() <= np.sqrt(3.0) * noise.orientation
    for name, truth, width in (
        ("gyro", v[3:6], noise.gyro), ("joint_pos", q[7:], noise.joint_pos), ("joint_vel", v[6:], noise.joint_vel)
    ):  # fmt: skip
        off = np.abs(np.array([getattr(t, name) for t in told]) - truth).max(axis=0)
        assert off.max() <= width + 1e-12 and (off > 0.5 * width).all()
    again = sensed(body, np.random.default_rng(0))
    for name in ("quat", "gyro", "joint_pos", "joint_vel"):
        np.testing.assert_array_equal(getattr(again, name), getattr(told[0], name))
