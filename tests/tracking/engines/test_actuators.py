"""Torque over speed: the servo's own law inside the envelope, the envelope outside, and the same limits for other engines."""

import mujoco
import numpy as np
import pytest

from robot_models import load_robot
from tracking.config import RandomisationConfig
from tracking.engines.actuators import limit_torque_by_speed, servo_gains, torque_limits
from tracking.engines.mujoco import training_model
from tracking.task.randomisation import draw_robots

KNEE, NO_LOAD = 0.7, 1.1


@pytest.fixture(scope="module")
def robot():
    return load_robot("g1")


def pair(robot):
    plain, limited = training_model(robot, 0.005), training_model(robot, 0.005)
    limit_torque_by_speed(limited, KNEE * robot.velocity, NO_LOAD * robot.velocity)
    return plain, limited


def torques(model, robot, target, speed):
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[6:] = robot.default_qpos, speed
    data.ctrl[:] = target
    mujoco.mj_forward(model, data)
    return data.actuator_force.copy()


def test_slow_motion_is_the_position_servos_to_the_last_digit(robot):
    ends = []
    for model in pair(robot):
        data = mujoco.MjData(model)
        data.qpos[:] = robot.default_qpos
        for step in range(100):
            data.ctrl[:] = robot.default_joint_pos + 0.1 * np.sin(0.1 * step)
            mujoco.mj_step(model, data)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


@pytest.mark.parametrize("share", [-1.2, -0.9, -0.3, 0.0, 0.5, 0.7, 0.9, 1.1, 1.3])
def test_torque_falls_from_the_knee_to_nothing_at_no_load_and_brakes_in_full(robot, share):
    plain, limited = pair(robot)
    speed, effort = share * robot.velocity, robot.effort
    # As much as the servo can ask for, forwards.
    pulled = torques(limited, robot, robot.default_joint_pos + 100.0, speed)
    slope = (NO_LOAD - share) / (NO_LOAD - KNEE)
    np.testing.assert_allclose(pulled, np.clip(slope, -1.0, 1.0) * effort, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(torques(plain, robot, robot.default_joint_pos + 100.0, speed), effort)
    # Another road to the same number: what engines without such motors are told.
    lower, upper = torque_limits(limited, speed)
    np.testing.assert_allclose(upper, pulled, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        lower, torques(limited, robot, robot.default_joint_pos - 100.0, speed), rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(torque_limits(plain, speed)[1], effort)


def test_gains_are_read_from_either_kind_of_motor(robot):
    for model in pair(robot):
        kp, kd = servo_gains(model)
        np.testing.assert_allclose(kp, robot.kp)
        np.testing.assert_allclose(kd, robot.kd)


def test_every_robot_draws_an_envelope_of_its_own_and_nothing_else_changes(robot):
    with_it, without = (
        draw_robots(robot, 6, 0.005, RandomisationConfig(torque_speed=on), np.random.default_rng(0))
        for on in (True, False)
    )
    no_load = np.array([m.actuator_gainprm[:, 7] / robot.velocity for m in with_it.models])
    assert np.ptp(no_load, axis=1).max() < 1e-12 and np.ptp(no_load[:, 0]) > 0.01
    assert (no_load >= 1.05).all() and (no_load <= 1.15).all()
    for a, b in zip(with_it.models, without.models, strict=True):
        np.testing.assert_allclose(servo_gains(a), servo_gains(b))
        for name in ("body_mass", "geom_friction", "body_ipos"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    np.testing.assert_array_equal(with_it.encoder_bias, without.encoder_bias)
    np.testing.assert_array_equal(with_it.delay, without.delay)
