"""The task: what is one robot's stays with it, sensors are true within their noise, two roads see the same."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import tracking
from clips import load_reference
from robot_models.maths import rotation as rot
from tracking import Runner, motion_of, read_contract
from tracking.config import RandomisationConfig, StartNoise, TaskConfig
from tracking.task.tracking_task import TrackingTask

FOLDER = Path(tracking.__file__).parent / "policies" / "groove-dancer"
CALM = TaskConfig(randomisation=RandomisationConfig(enabled=False), start_noise=StartNoise(scale=0.0))


@pytest.fixture(scope="module")
def reference(dancer):
    return load_reference(FOLDER / "reference.npz", dancer)


@pytest.fixture
def make(dancer, reference):
    made = []

    def task(envs=3, config=CALM, seed=0):
        made.append(TrackingTask(robot=dancer, reference=reference, envs=envs, config=config, seed=seed, threads=1))
        return made[-1]

    yield task
    for one in made:
        one.close()


def test_without_start_noise_a_robot_begins_as_the_reference_is(make):
    task, frames = make(), np.array([0, 200, 450])
    task.reset(np.arange(3), frames)
    np.testing.assert_allclose(task.physics.qpos, task.tables.qpos[frames], atol=1e-12)
    np.testing.assert_allclose(task.physics.qvel, task.tables.qvel[frames], atol=1e-12)
    np.testing.assert_allclose(rot.angle_between(task.heading, np.tile(rot.IDENTITY, (3, 1))), 0.0, atol=1e-7)


def test_start_noise_fills_its_widths_and_stays_inside_them_and_inside_the_joints_range(make):
    noise = StartNoise(scale=1.0)
    task = make(200, dataclasses.replace(CALM, start_noise=noise))
    frames = np.full(200, 100)
    task.reset(np.arange(200), frames)
    qpos, qvel = (
        now - then
        for now, then in ((task.physics.qpos, task.tables.qpos[frames]), (task.physics.qvel, task.tables.qvel[frames]))
    )
    for off, width in (
        (qpos[:, :3], noise.position),
        (qvel[:, :3], noise.linear_velocity),
        (qvel[:, 3:6], noise.angular_velocity),
    ):
        assert (np.abs(off) <= np.array(width) + 1e-12).all() and (
            np.abs(off).max(axis=0) > 0.9 * np.array(width)
        ).all()
    assert np.abs(qpos[:, 7:]).max() <= noise.joint_position + 1e-12 and not qvel[:, 6:].any()
    joints = task.physics.qpos[:, 7:]
    assert (joints >= task.robot.lower - 1e-12).all() and (joints <= task.robot.upper + 1e-12).all()
    turned = rot.angle_between(task.physics.qpos[:, 3:7], task.tables.qpos[frames, 3:7])
    assert 0.1 < turned.max() <= np.linalg.norm(noise.orientation)
    # The heading is the yaw of that disturbance: about the vertical, and no more than its width and what tilts add to it.
    assert not task.heading[:, 1:3].any() and np.abs(rot.yaw(task.heading)).max() < noise.orientation[2] + 0.02


def test_a_reset_of_some_leaves_the_others_as_they_were(make):
    task = make(4, dataclasses.replace(TaskConfig(), look_back=(1, 2)))
    for _ in range(3):
        task.step(np.full((4, 28), 0.2))
    names = ("frame", "last_action", "heading")
    before = {k: getattr(task, k).copy() for k in names} | {"past": task.past.copy().swapaxes(0, 1)}
    state, bodies = task.physics.state.copy(), task.sensors.states.pos.copy()
    task.reset(np.array([1, 3]), np.array([50, 60]))
    after = {k: getattr(task, k) for k in names} | {"past": task.past.swapaxes(0, 1)}
    for name, value in (before | {"state": state, "bodies": bodies}).items():
        now = {**after, "state": task.physics.state, "bodies": task.sensors.states.pos}[name]
        np.testing.assert_array_equal(now[[0, 2]], value[[0, 2]], err_msg=name)
        assert (now[[1, 3]] != value[[1, 3]]).any(), name
    assert not task.last_action[[1, 3]].any() and list(task.frame[[1, 3]]) == [50, 60]
    # Before its first instant there was, for all that is known, the same.
    np.testing.assert_array_equal(task.past[:, [1, 3]], np.tile(task.physics.state[[1, 3]], (3, 1, 1)))


def test_what_one_robot_does_is_nothing_to_another(make, rng):
    one, two = make(1), make(2)
    one.reset(np.array([0]), np.array([90]))
    two.reset(np.arange(2), np.array([300, 90]))
    for _ in range(5):
        action = 0.2 * rng.normal(size=(2, 28))
        alone, both = one.step(action[1:]), two.step(action)
        np.testing.assert_allclose(both.reward[1:], alone.reward, rtol=1e-12)
        np.testing.assert_array_equal(two.physics.state[1:], one.physics.state)


def test_an_action_moves_the_targets_by_its_own_unit_inside_their_range(make, rng):
    task = make(3)
    task.reset(np.arange(3), np.full(3, 100))
    action = rng.normal(size=(3, 28))
    action[2] = 1e3
    task.step(action)
    prior, heard = task.targets[101], task.physics.targets[:, 0]
    np.testing.assert_allclose(
        heard[:2], np.clip(prior + task.action_scale * action[:2], *task.target_range), atol=1e-12
    )
    np.testing.assert_allclose(heard[2], task.target_range[1])
    np.testing.assert_allclose(task.action_scale * task.robot.kp, 0.5 * task.robot.effort)  # a unit is half the effort


def test_the_reward_is_that_of_a_control_period_and_nothing_both_ends_and_runs_out(make):
    task = make(3)
    task.reset(np.arange(3), np.array([100, task.tables.frames - 2, task.tables.frames - 2]))
    task.physics.qpos[2, 2] += 1.0
    result = task.step(np.zeros((3, 28)))
    np.testing.assert_allclose(result.reward, task.dt * sum(result.terms.values()))
    assert list(result.terminated) == [False, False, True] and list(result.truncated) == [False, True, False]
    np.testing.assert_array_equal(result.terminated, np.any(list(result.causes.values()), axis=0))
    np.testing.assert_array_equal(task.starts.failures[-1:], task.frame[2:])  # remembered for practice


def test_a_state_that_is_no_number_ends_the_robot_and_spoils_nothing(make):
    task, twin = make(2), make(2)
    for t in (task, twin):
        t.reset(np.arange(2), np.array([100, 200]))
    task.physics.qvel[0, 10] = np.nan
    result, wanted = task.step(np.zeros((2, 28))), twin.step(np.zeros((2, 28)))
    assert list(result.causes["diverged"]) == [True, False] and result.terminated[0]
    np.testing.assert_array_equal(task.physics.qpos[0], task.tables.qpos[101])  # on the reference at once
    assert np.isfinite(result.reward).all() and all(np.isfinite(x).all() for x in task.observe())
    assert result.reward[1] == wanted.reward[1]


def test_sensors_tell_the_truth_within_their_noise_and_each_encoder_and_imu_its_own_fault(make):
    task = make(100, TaskConfig())
    task.reset(np.arange(100), np.full(100, 100))
    qpos, qvel, noise = task.physics.qpos, task.physics.qvel, task.config.observation_noise
    exact = task.measured(noisy=False)
    np.testing.assert_allclose(exact.joint_pos - qpos[:, 7:], task.encoder_bias, atol=1e-12)
    assert task.encoder_bias.any()
    mounted = rot.angle_between(exact.quat, qpos[:, 3:7])
    assert (
        0.5 * task.config.randomisation.imu_mounting
        < mounted.max()
        <= np.sqrt(3.0) * task.config.randomisation.imu_mounting
    )
    # One turned body: what it says of its own turn and of its own angular velocity fit together.
    np.testing.assert_allclose(rot.rotate(exact.quat, exact.gyro), rot.rotate(qpos[:, 3:7], qvel[:, 3:6]), atol=1e-12)
    right = task.measured(noisy=False, faulty=False)
    np.testing.assert_array_equal(right.joint_pos, qpos[:, 7:])
    np.testing.assert_allclose(right.quat, qpos[:, 3:7], atol=1e-12)
    np.testing.assert_allclose(right.gyro, qvel[:, 3:6], atol=1e-12)
    np.testing.assert_allclose(rot.rotate(right.quat, right.root_lin_vel), qvel[:, :3], atol=1e-12)
    noisy = task.measured()
    for name, width in (("gyro", noise.gyro), ("joint_pos", noise.joint_position), ("joint_vel", noise.joint_velocity)):
        off = np.abs(getattr(noisy, name) - getattr(exact, name))
        assert 0.95 * width < off.max() <= width + 1e-12, name
    assert 0.0 < rot.angle_between(noisy.quat, exact.quat).max() <= np.sqrt(3.0) * noise.orientation


@pytest.mark.parametrize("seed", [0, 1])
def test_a_runner_sees_from_the_sensors_what_the_task_observes_of_robots_drawn_at_random(make, reference, rng, seed):
    """Two roads to one observation: through the simulation's bodies, and through IMU, encoders and the contract's chain."""
    task = make(4, TaskConfig(look_back=(1,)), seed)
    contract = dataclasses.replace(read_contract(FOLDER / "contract.json"), observation=task.actor.rows)
    runner = Runner(contract, lambda seen: action, motion_of(reference, contract))
    task.reset(np.arange(4), np.full(4, 100))
    runner.start(task.measured(noisy=False), 100)
    # The chain to the anchor goes through the waist, whose encoders have a bias that the simulation's bodies have not.
    slack = 3.0 * np.abs(task.encoder_bias).max()
    for _ in range(5):
        action = 0.1 * rng.normal(size=(4, 28))
        seen, targets = task.observe(noisy=False)[0], runner.act(task.measured(noisy=False))
        for name, part in task.actor.slices.items():
            allowed = slack if name == "anchor_orientation" else 2e-6
            np.testing.assert_allclose(runner.seen[:, part], seen[:, part], atol=allowed, err_msg=name)
        task.step(action)
        np.testing.assert_allclose(task.physics.targets[:, 0] + task.encoder_bias, targets, atol=1e-9)


def test_a_saved_state_is_a_copy_that_later_steps_do_not_touch(make):
    task = make(2, TaskConfig())
    task.step(np.zeros((2, 28)))
    saved = task.state_dict()
    kept = {k: np.copy(v) for k, v in saved.items() if k != "rng"}
    first = [task.step(np.full((2, 28), 0.1)).reward for _ in range(3)]
    for name, value in kept.items():
        np.testing.assert_array_equal(saved[name], value, err_msg=name)
    for _ in range(2):  # and can be gone back to more than once
        task.load_state_dict(saved)
        np.testing.assert_array_equal([task.step(np.full((2, 28), 0.1)).reward for _ in range(3)], first)
