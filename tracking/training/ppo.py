"""rsl-rl's PPO on the tracking task: its algorithm and storage, driven by a loop of our own.

The library's runner prints to the console and inspects git repositories; its algorithm does neither.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

# Threads of torch that spin while they wait steal the cores from the physics threads; they must read this at import.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import numpy as np
import torch
from tensordict import TensorDict

from robot_models.maths import Array, array_namespace, to_numpy
from tracking.config import PpoConfig
from tracking.task import StepResult, TrackingTask
from tracking.training.distributed import Team

Actor = Any  # rsl_rl.models.MLPModel
_CRITIC_ALONE, _BEGUN_STD = 50, 0.12  # iterations, and exploration, where a policy is there before its critic
_DIVERGENCE_STEPS = 6  # of a batch from which the divergence is measured: all of them tell the same


@dataclass(frozen=True, kw_only=True)
class Iteration:
    """What one round of rollouts and updates came to."""

    steps: int  # control steps in this iteration, of all processes; what follows is of this one's robots
    losses: dict[str, float]
    episode_s: float  # mean length of the episodes that ended [s], NaN if none did
    terms: dict[str, float]  # mean of every reward term
    causes: dict[str, int]  # failures by cause
    std: float  # mean standard deviation of the action
    kl: float  # divergence of the new policy from the old on this batch
    rate: float  # learning rate of the next update


class Trainer:
    """PPO's networks, storage and optimiser around one batched task."""

    def __init__(
        self, task: TrackingTask, config: PpoConfig, seed: int, threads: int = 0, team: Team | None = None
    ) -> None:
        self.task, self.config, self.team = task, config, team or Team()
        torch.manual_seed(seed)
        torch.set_num_threads(self.team.threads(threads))
        self.algorithm = self._make_algorithm()
        if self.team.size > 1:
            self.algorithm.broadcast_parameters()
            torch.manual_seed(seed + self.team.rank)  # one network, but everyone explores with noise of their own
        self.std_range = config.std_range
        self.age = task.physics.to_device(np.zeros(task.envs))  # control steps since each robot's reset
        self.critic_alone = 0  # iterations from now on that leave the actor as it is

    @property
    def actor(self) -> Actor:
        """The policy network; called on observations it gives the mean action."""
        return self.algorithm.get_policy()

    def iterate(self, kl: float) -> Iteration:
        """Collect one batch and learn from it; the next update shall have this divergence."""
        self.algorithm.train_mode()
        observation = self._observe()
        xp = array_namespace(self.age)
        ended: list[Array] = []
        terms: dict[str, Array] = {}
        causes: dict[str, Array] = {}
        # Sums stay where the task computes until the end: to look at a number on a device is to wait for it.
        with torch.no_grad():
            for _ in range(self.config.steps_per_env):
                result = self.task.step(self._as_the_task_has_it(self.algorithm.act(observation)))
                self.age += 1
                truncated = result.truncated | (~result.terminated & (self.age * self.task.dt >= self.config.episode_s))
                done = xp.where(result.terminated | truncated)[0]
                ended.append(self.age[done])
                for name, value in result.terms.items():
                    terms[name] = terms.get(name, 0.0) + value.mean()
                for name, cause in result.causes.items():
                    causes[name] = causes.get(name, 0) + cause.sum()
                self.task.reset(done)
                self.age[done] = 0
                observation = self._observe()
                self._record(observation, result, truncated)
            self.algorithm.compute_returns(observation)
        alone = self.critic_alone > 0
        losses = self._update()
        divergence = self._divergence()
        if not alone:  # an actor that is left as it is diverges from nothing
            self._adapt_rate(divergence, kl)
        self._keep_exploring()
        lasted = to_numpy(xp.concat(ended)) * self.task.dt
        return Iteration(
            steps=self.team.size * self.task.envs * self.config.steps_per_env,
            losses={k: float(v) for k, v in losses.items()},
            episode_s=float(lasted.mean()) if len(lasted) else float("nan"),
            terms={k: float(v) / self.config.steps_per_env for k, v in terms.items()},
            causes={k: int(v) for k, v in causes.items()},
            std=float(self.algorithm.actor.output_std.detach().mean()),
            kl=divergence,
            rate=float(self.algorithm.learning_rate),
        )

    def begin_with_critic(self) -> None:
        """Let the critic of an actor that can do something already learn alone for a while, exploration being small."""
        self.critic_alone = _CRITIC_ALONE
        with torch.no_grad():
            self.algorithm.actor.distribution.log_std_param.fill_(np.log(_BEGUN_STD))

    def _update(self) -> dict[str, float]:
        """Learn from the batch."""
        if not self.critic_alone:
            return dict(self.algorithm.update())
        self.critic_alone -= 1
        before = {name: value.clone() for name, value in self.algorithm.actor.state_dict().items()}
        losses = dict(self.algorithm.update())
        self.algorithm.actor.load_state_dict(before)
        if not self.critic_alone:  # the actor's first step is the smallest; the divergence tells what it bears
            self._set_rate(self.config.rate_range[0])
        return losses

    def _as_the_task_has_it(self, action: torch.Tensor) -> Array:
        return action if array_namespace(self.age) is torch else action.numpy().astype(np.float64)

    def _observe(self) -> TensorDict:
        # Fresh tensors each time: the storage keeps a reference until the step is over.
        actor, critic = self.task.observe()
        groups = {"policy": torch.as_tensor(actor), "critic": torch.as_tensor(critic)}
        return TensorDict(groups, batch_size=[self.task.envs], device=self.task.physics.device)

    def _record(self, observation: TensorDict, result: StepResult, truncated: Array) -> None:
        self.algorithm.process_env_step(
            observation,
            torch.as_tensor(result.reward, dtype=torch.float32),
            torch.as_tensor(result.terminated | truncated),
            {"time_outs": torch.as_tensor(truncated)},
        )

    def _divergence(self) -> float:
        """KL divergence of the policy before the update from the one after it, mean over some steps of the batch."""
        storage, actor = self.algorithm.storage, self.algorithm.actor
        some = slice(0, None, max(1, storage.num_transitions_per_env // _DIVERGENCE_STEPS))
        before = tuple(p[some].flatten(0, 1) for p in storage.distribution_params)
        with torch.inference_mode():
            actor(storage.observations[some].flatten(0, 1), stochastic_output=True)
            divergence = float(actor.get_kl_divergence(before, actor.output_distribution_params).mean())
        return self.team.mean(divergence)

    def _adapt_rate(self, divergence: float, wanted: float) -> None:
        """Bring the next update's divergence nearer to the wanted one.

        The library's own rule changes the rate within an update: small batches let it jump tenfold in one.
        """
        factor = np.clip(wanted / max(divergence, 1e-9), *self.config.rate_steps)
        self._set_rate(float(np.clip(self.algorithm.learning_rate * factor, *self.config.rate_range)))

    def _set_rate(self, rate: float) -> None:
        self.algorithm.learning_rate = rate
        self.algorithm.optimizer.param_groups[0]["lr"] = rate  # a second group is a critic's

    def _make_algorithm(self) -> Any:
        return make_algorithm(self._observe(), self.task, self.config, self.team)

    def _keep_exploring(self) -> None:
        """Hold log-std inside its range: the library clamps it on use, where a parameter outside gets no gradient."""
        low, high = self.std_range
        with torch.no_grad():
            self.algorithm.actor.distribution.log_std_param.clamp_(np.log(low), np.log(high))


def make_algorithm(
    observation: TensorDict,
    task: TrackingTask,
    c: PpoConfig,
    team: Team,
    *,
    make_actor: Callable[..., Any] | None = None,
    make_critic: Callable[..., Any] | None = None,
    critic_sees: Sequence[str] = ("critic",),
    critic_hidden: Sequence[int] | None = None,
) -> Any:
    """The library's algorithm on networks for the groups of an observation.

    Args:
        observation: groups of numbers; the actor sees "policy".
        task: gives the device and the number of actions.
        c: all numbers.
        team: the processes that learn together.
        make_actor: called as rsl-rl's `MLPModel`, which is the default.
        make_critic: the same.
        critic_sees: groups that the critic sees.
        critic_hidden: layers of the critic; by default the actor's.
    """
    from rsl_rl.algorithms import PPO
    from rsl_rl.models import MLPModel
    from rsl_rl.storage import RolloutStorage

    groups = {"actor": ["policy"], "critic": list(critic_sees)}
    net = {"activation": "elu", "obs_normalization": True}
    noise = {
        "class_name": "rsl_rl.modules:GaussianDistribution",
        "init_std": c.initial_std,
        "std_type": "log",
        "std_range": c.std_range,
        "learn_std": True,
    }
    actor = (make_actor or MLPModel)(
        observation, groups, "actor", task.actions, distribution_cfg=noise, hidden_dims=list(c.hidden), **net
    ).to(task.physics.device)
    critic = (make_critic or MLPModel)(
        observation, groups, "critic", 1, hidden_dims=list(critic_hidden or c.hidden), **net
    ).to(task.physics.device)
    with torch.no_grad():
        # Start from the prior: the first policy asks for the reference itself.
        last = [m for m in actor.modules() if isinstance(m, torch.nn.Linear)][-1]
        last.weight.mul_(c.initial_output)
        last.bias.zero_()
    storage = RolloutStorage("rl", task.envs, c.steps_per_env, observation, [task.actions], task.physics.device)
    return PPO(
        actor,
        critic,
        storage,
        device=task.physics.device,
        num_learning_epochs=c.epochs,
        num_mini_batches=c.minibatches,
        clip_param=c.clip,
        gamma=c.gamma,
        lam=c.lam,
        value_loss_coef=c.value_weight,
        entropy_coef=c.entropy,
        learning_rate=c.rate_range[1],
        max_grad_norm=c.max_grad_norm,
        optimizer="adam",
        use_clipped_value_loss=True,
        schedule="fixed",
        normalize_advantage_per_mini_batch=False,
        multi_gpu_cfg=team.for_rsl_rl,
    )
