"""A policy to begin with: its network comes back whole, of another kind it is refused, and its first steps do not undo it."""

import dataclasses

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("onnx")

from tracking import PpoConfig, TaskConfig, TrackingError, TrackingTask, TrainConfig, load_bundle, train
from tracking.policy import POLICY, onnx_policy
from tracking.policy.bundle import SHIPPED
from tracking.task import read_named_reference
from tracking.training import Trainer, begin_with, torch_policy
from tracking.training.actor_import import misfit
from tracking.training.checkpoint import begin_run

GROOVE = SHIPPED / "groove-dancer"
CONFIG = TrainConfig(
    steps=4 * 8 * 3, envs=8, threads=1, rollouts=2, ppo=dataclasses.replace(PpoConfig(), steps_per_env=4, minibatches=2)
)


@pytest.fixture(scope="module")
def bundle():
    return load_bundle(GROOVE)


@pytest.fixture
def task(bundle):
    task = TrackingTask(robot=bundle.robot, reference=bundle.reference, envs=8, config=TaskConfig(), threads=1)
    yield task
    task.close()


def test_the_network_comes_back_as_it_was_exported(task):
    trainer = Trainer(task, CONFIG.ppo, 0, 1)
    seen = task.observe()[0]
    exported = onnx_policy(GROOVE / POLICY)(seen)
    assert np.abs(torch_policy(trainer.actor)(seen) - exported).max() > 0.1
    begin_with(trainer.actor, GROOVE, task)
    np.testing.assert_allclose(torch_policy(trainer.actor)(seen), exported, atol=1e-5)


@pytest.mark.parametrize(
    ("config", "ppo", "told"),
    [
        (TaskConfig(look_back=(1,)), PpoConfig(), "observation"),
        (TaskConfig(action_scale=0.25), PpoConfig(), "action_scale"),
        (TaskConfig(), PpoConfig(hidden=(256, 64)), "mlp.2.weight of"),
    ],
)
def test_a_policy_of_another_kind_is_refused_and_changes_nothing(bundle, config, ppo, told):
    task = TrackingTask(robot=bundle.robot, reference=bundle.reference, envs=2, config=config, threads=1)
    trainer = Trainer(task, ppo, 0, 1)
    seen = task.observe()[0]
    before = torch_policy(trainer.actor)(seen)
    assert told in misfit(trainer.actor, GROOVE, task)
    with pytest.raises(TrackingError, match=told):
        begin_with(trainer.actor, GROOVE, task)
    np.testing.assert_array_equal(torch_policy(trainer.actor)(seen), before)
    task.close()


def test_what_is_no_policy_or_another_robots_is_refused(task, tmp_path):
    trainer = Trainer(task, CONFIG.ppo, 0, 1)
    with pytest.raises(TrackingError, match="no bundle"):
        begin_with(trainer.actor, tmp_path, task)
    assert "another robot (" in misfit(trainer.actor, SHIPPED / "groove-g1", task)


def test_the_critic_of_a_bundle_learns_alone_at_first(task):
    trainer = Trainer(task, CONFIG.ppo, 0, 1)
    begin_run(trainer, GROOVE)
    assert trainer.critic_alone > 0
    actor, critic = ([p.clone() for p in net.parameters()] for net in (trainer.actor, trainer.algorithm.critic))
    trainer.iterate(0.01)
    assert all(torch.equal(a, b) for a, b in zip(actor, trainer.actor.parameters(), strict=True))
    assert not all(torch.equal(a, b) for a, b in zip(critic, trainer.algorithm.critic.parameters(), strict=True))
    trainer.critic_alone = 1  # the last of these iterations
    trainer.iterate(0.01)
    assert trainer.algorithm.learning_rate == CONFIG.ppo.rate_range[0]  # not what no divergence at all would ask for
    trainer.iterate(0.01)
    assert not all(torch.equal(a, b) for a, b in zip(actor, trainer.actor.parameters(), strict=True))


def test_of_a_run_the_critic_and_the_optimiser_come_along(bundle, task, tmp_path):
    piece = read_named_reference(GROOVE / "reference.npz")
    train(bundle.robot, [piece], tmp_path / "first", CONFIG)
    before = torch.load(tmp_path / "first" / "checkpoint.pt", weights_only=True)["algorithm"]
    trainer = Trainer(task, CONFIG.ppo, 5, 1)
    begin_run(trainer, tmp_path / "first")
    assert trainer.critic_alone == 0
    for name, value in trainer.algorithm.critic.state_dict().items():
        assert torch.equal(value, before["critic_state_dict"][name])
    again = train(bundle.robot, [piece], tmp_path / "second", CONFIG, begin=tmp_path / "first")
    assert again.begun and again.curves[0]["steps"] == 0.0
