"""MuJoCo-Warp on its CPU device, a few worlds: the same robots, delays and steps as MuJoCo's, the same task on tensors."""

from functools import partial

import numpy as np
import pytest

pytest.importorskip("mujoco_warp")
pytestmark = pytest.mark.slow  # a minute of kernels where none are cached

import torch

from clips import load_reference
from robot_models import load_robot
from robot_models.maths.arrays import to_numpy
from tracking import TrackingError, TrackingTask, TrainConfig
from tracking.engines.warp import WarpBatch
from tracking.training.ppo import Trainer

CPU = partial(WarpBatch, device="cpu")
WORLDS, STARTS = 4, (50, 110, 170, 230)


class SameChance:
    """NumPy's numbers where the task computes, so that two engines draw alike."""

    def __init__(self, seed, to_device):
        self._rng, self._own = np.random.default_rng(seed), to_device

    def __getattr__(self, name):
        draw = getattr(self._rng, name)
        return lambda *bounds, size: self._own(draw(*map(to_numpy, bounds), size=size))


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
    """States, rewards and observations under the same actions, with pushes on the way."""
    to_device = task.physics.to_device
    task.rng = SameChance(5, to_device)
    task.pushes.wait = to_device(np.array([7.0, 3.0, 11.0, 30.0]))
    task.reset(to_device(np.arange(WORLDS)), to_device(np.array(start)))
    told = []
    for k in range(steps):
        action = 0.3 * np.sin(0.3 * k + np.arange(task.actions)) * np.ones((WORLDS, 1))
        result = task.step(to_device(action))
        told.append([to_numpy(x).copy() for x in (task.physics.state, result.reward, *task.observe())])
    return [np.stack(x) for x in zip(*told, strict=True)]


def test_a_second_of_dancing_is_mujocos(tasks):
    ours, theirs = (play(t, 50, STARTS) for t in tasks)
    physics = tasks[0].physics
    np.testing.assert_allclose(physics.qpos_of(theirs[0]), physics.qpos_of(ours[0]), atol=1e-5)  # metres and radians
    np.testing.assert_allclose(physics.qvel_of(theirs[0]), physics.qvel_of(ours[0]), atol=2e-3)
    for mine, its, apart in zip(ours[1:], theirs[1:], (1e-5, 5e-4, 5e-4), strict=True):
        np.testing.assert_allclose(its, mine, atol=apart)
    # The negative control: robots that were not drawn anew part from these at once.
    assert np.ptp(ours[0][-1, :, 3]) > 1e-3


def test_bodies_are_where_mujocos_are_and_move_as_they_do(tasks):
    for task in tasks:
        play(task, 10, STARTS)
    ours, theirs = (t.sensors.states for t in tasks)
    for name in ("pos", "quat", "lin_vel", "ang_vel"):
        np.testing.assert_allclose(to_numpy(getattr(theirs, name)), getattr(ours, name), atol=1e-3, err_msg=name)


def test_no_array_leaves_the_device_or_comes_to_it_while_robots_dance(tasks, monkeypatch):
    task = tasks[1]
    task.rng = task.physics.make_rng(np.random.default_rng(0))
    action, everyone = (
        task.physics.to_device(np.zeros((WORLDS, task.actions))),
        task.physics.to_device(np.arange(WORLDS)),
    )
    task.pushes.wait[:] = 2.0

    def refuse(*args, **kwargs):
        raise AssertionError("arrays between the device and main memory")

    task.observe()  # makes what is made once
    with monkeypatch.context() as patched:
        for name in ("numpy", "__array__", "cpu", "tolist"):
            patched.setattr(torch.Tensor, name, refuse)
        for name in ("from_numpy", "tensor", "as_tensor"):
            patched.setattr(torch, name, refuse)
        for _ in range(4):
            result = task.step(action)
            task.reset(torch.where(result.terminated | result.truncated)[0])
            task.reset(everyone)
            task.observe()
        with pytest.raises(AssertionError):
            to_numpy(result.reward)


def test_it_trains(tasks, tmp_path):
    task = tasks[1]
    task.rng = task.physics.make_rng(np.random.default_rng(0))
    trainer = Trainer(task, TrainConfig().ppo, seed=0, threads=1)
    before = [p.clone() for p in trainer.actor.parameters()]
    told = trainer.iterate(0.01)
    assert all(np.isfinite([*told.losses.values(), *told.terms.values(), told.kl]))
    assert any((a != b).any() for a, b in zip(before, trainer.actor.parameters(), strict=True))


def test_every_world_has_its_own_friction_mass_and_gains(tasks):
    physics = tasks[1].physics
    for name in ("geom_friction", "body_mass", "body_ipos", "actuator_gainprm"):
        given = np.stack([getattr(m, name) for m in physics.models])
        np.testing.assert_allclose(getattr(physics._model, name).numpy(), given, rtol=1e-6)
        assert np.ptp(given, axis=0).max() > 0.0


def test_a_robot_that_is_put_back_goes_on_from_there(tasks):
    task = tasks[1]
    play(task, 3, STARTS)
    still, to_device = torch.zeros((WORLDS, task.actions)), task.physics.to_device
    task.physics.qpos[1, 2] = np.nan
    result = task.step(still)
    assert result.causes["diverged"].tolist() == [False, True, False, False]
    task.reset(to_device(np.array([1])), to_device(np.array([STARTS[1]])))
    assert torch.isfinite(task.step(still).reward).all()
    assert torch.isfinite(task.physics.state).all()


def test_constraints_that_do_not_fit_are_refused_and_a_solver_that_is_stopped_is_not(tasks):
    from mujoco_warp import OverflowType

    physics = tasks[1].physics
    physics.tensors["overflow"].fill_(int(OverflowType.ITERATIONS | OverflowType.LS_ITERATIONS))
    physics.step(physics.targets[:, 0].clone())
    physics.tensors["overflow"].fill_(int(OverflowType.NEFC))
    with pytest.raises(TrackingError, match="did not fit in 4 worlds"):
        physics.step(physics.targets[:, 0].clone())
    physics.tensors["overflow"].zero_()


def test_a_saved_task_goes_on_bit_for_bit(tasks):
    task = tasks[1]
    play(task, 5, STARTS)
    task.rng = task.physics.make_rng(np.random.default_rng(0))
    saved = task.state_dict()
    ends = []
    for _ in range(2):
        task.load_state_dict(saved)
        for _ in range(5):
            task.step(torch.full((WORLDS, task.actions), 0.2))
        task.reset(torch.arange(WORLDS))
        ends.append(to_numpy(task.physics.state).copy())
    np.testing.assert_array_equal(*ends)


def test_without_a_cuda_device_it_is_refused(tasks):
    import warp

    if warp.get_cuda_device_count():
        pytest.skip("there is one here")
    with pytest.raises(TrackingError, match="no CUDA device"):
        WarpBatch(tasks[0].physics.models, control_dt=0.02)
