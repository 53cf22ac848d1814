"""A teacher: a network that sees the robot's whole state, learns to follow any reference, and teaches smaller ones.

It is mirror-symmetric by construction where its robot is: the mean of the network and of its mirror image. Begun that
way it dances twice as long after the same number of steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from clips import Reference
from robot_models import Reflection, RobotModel
from robot_models.maths import Array
from tracking.config import TaskConfig, TeacherConfig
from tracking.task import TrackingTask, symmetry_of
from tracking.training import Iteration, Trainer, make_algorithm


def half_precision(device: str, wanted: bool = True) -> torch.autocast:
    """Matrix products in bfloat16 where the processor has an instruction for them: a third of the time."""
    there = device != "cpu" or torch.cpu._is_avx512_bf16_supported() or torch.cpu._is_amx_tile_supported()
    return torch.autocast(device, torch.bfloat16, enabled=wanted and there)


class SymmetricActor(MLPModel):  # type: ignore[misc]
    """An actor whose answer to a mirrored state is the mirrored answer.

    Args:
        seen: what an observation is in the mirror; None: a plain network.
        done: what an action is in the mirror.
        given: as of rsl-rl's `MLPModel`.
    """

    def __init__(self, *given: Any, seen: Reflection | None, done: Reflection | None, **named: Any) -> None:
        super().__init__(*given, **named)
        self.symmetric = seen is not None and done is not None
        for name, reflection in (("seen", seen), ("done", done)):
            if reflection is not None:
                self.register_buffer(f"{name}_order", torch.as_tensor(reflection.order))
                self.register_buffer(f"{name}_sign", torch.as_tensor(reflection.sign, dtype=torch.float32))

    def forward(
        self, obs: TensorDict, masks: Any = None, hidden_state: Any = None, stochastic_output: bool = False
    ) -> torch.Tensor:
        """As of `MLPModel`."""
        if not self.symmetric:
            return super().forward(obs, masks, hidden_state, stochastic_output)
        seen = torch.cat([obs[group] for group in self.obs_groups], dim=-1)
        both = self.obs_normalizer(torch.cat((seen, seen[:, self.seen_order] * self.seen_sign)))
        # What explores is half as exact: 0.004 of the action's size, a twentieth of the exploration.
        with half_precision(both.device.type, stochastic_output):
            one, other = self.mlp(both).float().chunk(2)
        mean = 0.5 * (one + other[:, self.done_order] * self.done_sign)
        if not stochastic_output:
            return self.distribution.deterministic_output(mean)
        self.distribution.update(mean)
        return self.distribution.sample()


class HalfPrecisionCritic(MLPModel):  # type: ignore[misc]
    """A critic whose matrix products are in half precision: values are noisy anyway."""

    def forward(self, *given: Any, **named: Any) -> torch.Tensor:
        """As of `MLPModel`."""
        with half_precision(next(self.parameters()).device.type):
            return super().forward(*given, **named).float()


class TeacherTrainer(Trainer):
    """PPO of a teacher; everything that changes on the way follows the schedule of `TeacherConfig`."""

    def __init__(self, task: TrackingTask, teacher: TeacherConfig, seed: int, threads: int = 1) -> None:
        self.teacher = teacher
        super().__init__(task, teacher.ppo, seed, threads)
        self.task.disturb(0.0, 0.0)

    def iterate_at(self, steps: int, kl: float = 0.0) -> Iteration:
        """One iteration, after so many control steps; with a divergence other than the schedule's where one is given."""
        t = self.teacher
        part = t.disturbance(steps)
        self.task.disturb(part, part)
        self.algorithm.gamma, self.algorithm.lam = t.gamma.at(steps), t.lam.at(steps)
        self.algorithm.entropy_coef = t.ppo.entropy * max(0.0, 1.0 - steps / t.entropy_until)
        std = t.std.at(steps)
        self.std_range = (std / t.std_slack, std * t.std_slack)
        return self.iterate(kl or t.kl.at(steps) * t.calm.at(steps))

    def _observe(self) -> TensorDict:
        # With a pupil's noise: what acts on exact joint velocities cannot be learnt from by one whose own are noisy.
        seen, besides = self.task.observe_all(noisy=True)
        groups = {"policy": torch.as_tensor(seen), "privileged": torch.as_tensor(besides)}
        return TensorDict(groups, batch_size=[self.task.envs], device=self.task.physics.device)

    def _make_algorithm(self) -> Any:
        algorithm = make_algorithm(
            self._observe(), self.task, self.config, self.team, make_actor=teacher_network(self.task),
            make_critic=HalfPrecisionCritic, critic_sees=("policy", "privileged"), critic_hidden=self.teacher.critic_hidden,
        )  # fmt: skip
        rates = ((algorithm.actor, algorithm.learning_rate), (algorithm.critic, self.teacher.critic_rate))
        algorithm.optimizer = torch.optim.Adam([{"params": list(net.parameters()), "lr": rate} for net, rate in rates])
        return algorithm


def teacher_actions(actor: SymmetricActor, seen: Float[Array, "N T"]) -> Float[Array, "N J"]:
    """What a teacher does, without noise, where it sees this."""
    with torch.inference_mode():
        groups = TensorDict({"policy": torch.as_tensor(seen)}, batch_size=[len(seen)])
        return np.asarray(actor(groups).cpu().numpy(), dtype=np.float64)


def teacher_network(task: TrackingTask) -> Any:
    """What makes a teacher's actor for a task."""
    symmetry = symmetry_of(task.robot)
    seen = symmetry.of_rows(task.teacher.rows) if symmetry else None
    return partial(SymmetricActor, seen=seen, done=symmetry.joints if symmetry else None)


def teaching_task(
    robot: RobotModel,
    references: Sequence[Reference],
    config: TeacherConfig,
    *,
    task: TaskConfig | None = None,
    seed: int = 0,
    threads: int = 1,
    focus: int = 0,
) -> TrackingTask:
    """The task that a teacher learns on: coarser physics, starts where practice is needed."""
    own = replace(task or TaskConfig(), physics_dt=config.physics_dt, starts=config.starts)
    return TrackingTask(
        robot=robot, reference=references, envs=config.envs, config=own, seed=seed, threads=threads, focus=focus
    )
