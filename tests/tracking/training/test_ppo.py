"""PPO around the task: the rate follows the divergence, the divergence is the textbook's, and counts are what happened."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import tracking
from clips import load_reference
from tracking import PpoConfig, TrackingTask
from tracking.training.ppo import Trainer

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
SMALL = PpoConfig(hidden=(16,), steps_per_env=6, epochs=2, minibatches=2)


def make(dancer, seed=0, envs=4):
    task = TrackingTask(robot=dancer, reference=load_reference(FILE, dancer), envs=envs, seed=seed, threads=1)
    return Trainer(task, SMALL, seed, threads=1)


@pytest.fixture(scope="module")
def trainer(dancer):
    made = make(dancer)
    yield made
    made.task.close()


def rates(trainer):
    return {trainer.algorithm.learning_rate, *(g["lr"] for g in trainer.algorithm.optimizer.param_groups)}


def set_rate(trainer, rate):
    trainer.algorithm.learning_rate = rate
    trainer._adapt_rate(1.0, 1.0)  # as wanted: nothing changes but that the optimiser hears
    assert rates(trainer) == {rate}


def weights(trainer):
    return torch.cat([p.detach().flatten() for p in trainer.actor.parameters()])


@pytest.mark.parametrize("divergence", [0.0, 1e-12, 0.01, 0.09, 0.1, 0.11, 0.13, 10.0, np.inf])
def test_the_rate_moves_towards_the_wanted_divergence_and_never_far_at_once(trainer, divergence):
    set_rate(trainer, 3e-4)
    trainer._adapt_rate(divergence, 0.1)
    (rate,) = rates(trainer)
    assert rate * (1 + 1e-12) >= 0.8 * 3e-4 and rate <= 1.25 * 3e-4 * (1 + 1e-12)
    assert np.sign(rate - 3e-4) == np.sign(0.1 - divergence)


@pytest.mark.parametrize(("divergence", "end"), [(10.0, 0), (1e-6, 1)])
def test_the_rate_stays_in_its_range_however_long_it_is_pushed(trainer, divergence, end):
    set_rate(trainer, 1e-4)
    for _ in range(60):
        trainer._adapt_rate(divergence, 0.1)
    assert rates(trainer) == {SMALL.rate_range[end]}


def test_a_larger_divergence_never_leads_to_a_higher_rate(trainer):
    seen = []
    for divergence in np.geomspace(1e-4, 10.0, 15):
        set_rate(trainer, 3e-4)
        trainer._adapt_rate(divergence, 0.06)
        seen += rates(trainer)
    assert (np.diff(seen) <= 0.0).all() and seen[0] > seen[-1]


def test_the_divergence_is_that_of_two_gaussians_and_none_of_a_policy_from_itself(trainer):
    trainer.iterate(0.05)
    storage, actor = trainer.algorithm.storage, trainer.algorithm.actor
    seen = storage.observations.flatten(0, 1)

    def normal():
        with torch.inference_mode():
            actor(seen, stochastic_output=True)
            return tuple(p.clone() for p in actor.output_distribution_params)

    now = normal()
    for kept, new in zip(storage.distribution_params, now, strict=True):
        kept.copy_(new.unflatten(0, kept.shape[:2]))
    assert trainer._divergence() == pytest.approx(0.0, abs=1e-6)
    last = [m for m in actor.modules() if isinstance(m, torch.nn.Linear)][-1]
    with torch.no_grad():
        last.bias += 0.07
        actor.distribution.log_std_param += 0.1
    after = normal()
    wanted = torch.distributions.kl_divergence(
        torch.distributions.Normal(*now), torch.distributions.Normal(*after)
    ).sum(-1).mean()  # fmt: skip
    assert trainer._divergence() == pytest.approx(float(wanted), rel=1e-4) and wanted > 0.1


@pytest.mark.parametrize(("log_std", "end"), [(5.0, 1), (-9.0, 0)])
def test_exploration_is_held_inside_its_range(trainer, log_std, end):
    param = trainer.algorithm.actor.distribution.log_std_param
    with torch.no_grad():
        param.fill_(log_std)
    trainer._keep_exploring()
    np.testing.assert_allclose(param.detach().exp().numpy(), SMALL.std_range[end], rtol=1e-6)


def test_an_untrained_policy_asks_for_hardly_more_than_the_reference(dancer):
    trainer = make(dancer, seed=5, envs=8)
    with torch.no_grad():
        mean = trainer.actor(trainer._observe())
    assert mean.abs().max() < SMALL.initial_std  # less than it explores by
    assert mean.abs().max() > 0.0
    trainer.task.close()


def test_counts_are_what_happened_in_the_task(dancer, monkeypatch):
    trainer = make(dancer, seed=1)
    task, ended, rewards = trainer.task, [], []
    real = task.step

    def step(action):
        result = real(action)
        ended.append(result.terminated | result.truncated)
        rewards.append(result.reward.mean())
        return result

    monkeypatch.setattr(task, "step", step)
    # Two robots are near their clip's end.
    task.reset(np.array([1, 2]), np.array([task.tables.frames - 4, task.tables.frames - 2]))
    age = np.zeros(4)
    broadcast = trainer.iterate(0.05)
    lasted = []
    for done in ended:
        age += 1
        lasted += list(age[done])
        age[done] = 0
    assert broadcast.steps == 4 * 6 and len(ended) == 6 and len(lasted) >= 2
    np.testing.assert_array_equal(trainer.age, age)
    assert broadcast.episode_s == pytest.approx(task.dt * np.mean(lasted))
    assert sum(broadcast.terms.values()) * task.dt == pytest.approx(np.mean(rewards))
    assert all(np.isfinite(v) for v in broadcast.losses.values()) and broadcast.kl >= 0.0
    assert SMALL.std_range[0] <= broadcast.std <= SMALL.std_range[1]
    assert SMALL.rate_range[0] <= broadcast.rate <= SMALL.rate_range[1]
    task.close()


def test_no_episode_that_ended_has_no_length(dancer):
    trainer = make(dancer, seed=1, envs=1)
    trainer.task.reset(np.array([0]), np.array([100]))
    broadcast = trainer.iterate(0.05)
    assert np.isnan(broadcast.episode_s) == (sum(broadcast.causes.values()) == 0)
    trainer.task.close()


def test_the_seed_decides_networks_and_what_they_learn(dancer):
    ends = []
    for seed in (3, 3, 4):
        trainer = make(dancer, seed)
        trainer.iterate(0.05)
        ends.append(weights(trainer))
        trainer.task.close()
    assert torch.equal(ends[0], ends[1]) and not torch.equal(ends[0], ends[2])
