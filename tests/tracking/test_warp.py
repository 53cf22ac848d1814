"""MuJoCo-Warp on its CPU device, a few worlds: the same robots, delays and steps as MuJoCo's."""

from functools import partial

import numpy as np
import pytest

pytest.importorskip("mujoco_warp")
pytestmark = pytest.mark.slow  # a minute of kernels where none are cached

from clips import load_reference
from robot_models import load_robot
from tracking import TrackingError, TrackingTask
from tracking.warp_batch import WarpBatch

CPU = partial(WarpBatch, device="cpu")
WORLDS, STARTS = 4, (50, 110, 170, 230)


@pytest.fixture(scope="module")
def tasks(groove_file):
    """One task in each engine; robots, delays and noise drawn alike."""
    robot = load_robot("dancer")
    reference = load_reference(groove_file, robot)
    made = [TrackingTask(robot=robot, reference=reference, envs=WORLDS, seed=3, threads=1)]
    made.append(TrackingTask(robot=robot, reference=reference, envs=WORLDS, seed=3, threads=1, engine=CPU))
    yield made
    for task in made:
        task.close()


def play(task, steps, start):
    """States and rewards under the same actions."""
    task.rng = np.random.default_rng(5)
    task.reset(np.arange(WORLDS), np.array(start))
    states, rewards = [], []
    for k in range(steps):
        result = task.step(0.3 * np.sin(0.3 * k + np.arange(task.actions)) * np.ones((WORLDS, 1)))
        states.append(task.physics.state.copy())
        rewards.append(result.reward)
    return np.array(states), np.array(rewards)


def test_a_second_of_dancing_is_mujocos(tasks):
    (ours, our_rewards), (theirs, their_rewards) = (play(t, 50, STARTS) for t in tasks)
    physics = tasks[0].physics
    np.testing.assert_allclose(physics.qpos_of(theirs), physics.qpos_of(ours), atol=5e-6)  # metres and radians
    np.testing.assert_allclose(physics.qvel_of(theirs), physics.qvel_of(ours), atol=1e-3)
    np.testing.assert_allclose(their_rewards, our_rewards, atol=1e-5)
    # The negative control: robots that were not drawn anew part from these at once.
    assert np.ptp(ours[-1, :, 3]) > 1e-3


def test_every_world_has_its_own_friction_mass_and_gains(tasks):
    physics = tasks[1].physics
    for name in ("geom_friction", "body_mass", "body_ipos", "actuator_gainprm"):
        given = np.stack([getattr(m, name) for m in physics.models])
        np.testing.assert_allclose(getattr(physics._model, name).numpy(), given, rtol=1e-6)
        assert np.ptp(given, axis=0).max() > 0.0


def test_a_robot_that_is_put_back_goes_on_from_there(tasks):
    task = tasks[1]
    play(task, 3, STARTS)
    task.physics.qpos[1, 2] = np.nan
    result = task.step(np.zeros((WORLDS, task.actions)))
    assert list(result.causes["diverged"]) == [False, True, False, False]
    task.reset(np.array([1]), np.array([STARTS[1]]))
    assert np.isfinite(task.step(np.zeros((WORLDS, task.actions))).reward).all()
    assert np.isfinite(task.physics.state).all()


def test_constraints_that_do_not_fit_are_refused(tasks):
    physics = tasks[1].physics
    physics._data.overflow.fill_(1)
    with pytest.raises(TrackingError, match="did not fit in 4 worlds"):
        physics.step(physics.targets[:, 0])
    physics._data.overflow.zero_()


def test_a_saved_task_goes_on_bit_for_bit(tasks):
    task = tasks[1]
    play(task, 5, STARTS)
    saved = task.state_dict()
    ends = []
    for _ in range(2):
        task.load_state_dict(saved)
        for _ in range(5):
            task.step(np.full((WORLDS, task.actions), 0.2))
        ends.append(task.physics.state.copy())
    np.testing.assert_array_equal(*ends)


def test_without_a_cuda_device_it_is_refused(tasks):
    import warp

    if warp.get_cuda_device_count():
        pytest.skip("there is one here")
    with pytest.raises(TrackingError, match="no CUDA device"):
        WarpBatch(tasks[0].physics.models, control_dt=0.02)
