"""A teacher's skill in a small network that sees what a robot can measure: DAgger (Ross et al. 2011).

The pupil dances, the teacher tells what it would have done in every state that the pupil comes to, and the pupil learns
all that it was told so far. In the beginning the teacher drives, so that there is something to see.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from jaxtyping import Bool, Float
from numpy import ndarray
from tensordict import TensorDict

from tracking.config import DistillationConfig
from tracking.task import TrackingTask
from tracking.teaching.adviser import Adviser


class Distillation:
    """A pupil that learns from an adviser on a task.

    Args:
        task: the pupil's, with noise, delays and draws as they shall be; in main memory.
        adviser: who knows what to do.
        actor: the pupil, rsl-rl's `MLPModel`.
        config: all numbers.
        labels: file for what is told, which a resumed run needs; half a kilobyte to one per label, in half precision.
        seed: of who drives and of the batches.
    """

    def __init__(
        self, task: TrackingTask, adviser: Adviser, actor: Any, config: DistillationConfig, labels: Path, seed: int = 0
    ) -> None:
        # Whether the pupil can dance already: it keeps its normaliser, and drives from the first episode on as in the end.
        self.begun = False
        self.task, self.adviser, self.actor, self.config = task, adviser, actor, config
        self.rng = np.random.default_rng(seed)
        self.samples, self.loss = 0, float("nan")
        self._optimiser = torch.optim.Adam(actor.mlp.parameters(), lr=config.rate[1])
        self._columns = np.cumsum((task.actor.size, task.actions))
        room = config.samples + config.steps_per_env * task.envs
        # Seen, then told, in a row. A file that is there is gone on with, and grows with the budget.
        mode: Literal["r+", "w+"] = "r+" if labels.is_file() else "w+"
        self._labels = np.memmap(labels, np.float16, mode=mode, shape=(room, int(self._columns[-1])))
        self._best: dict[str, Any] = {}
        self._best_score = -1.0
        self._age = np.zeros(task.envs)
        self._driven = np.ones(task.envs, dtype=bool)  # by the teacher, for this episode
        self.begin_anew()

    def iterate(self) -> dict[str, int]:
        """Let the robots dance for some control periods, then learn; returns failures by cause."""
        c, causes = self.config, dict[str, int]()
        self.actor.eval()
        for _ in range(c.steps_per_env):
            seen, advice = self.task.observe()[0], self.adviser.advise()
            self._remember(seen, advice)
            action = np.where(self._driven[:, None], advice, self._acts(seen))
            self.adviser.hear(action)
            result = self.task.step(action)
            self._age += 1
            for name, failed in result.causes.items():
                causes[name] = causes.get(name, 0) + int(failed.sum())
            self._begin_some_anew(result.terminated | result.truncated | (self._age * self.task.dt >= c.episode_s))
        self._learn()
        return causes

    @property
    def driving(self) -> float:
        """Share of the episodes in which the teacher drives now."""
        c = self.config
        part = 1.0 if self.begun else min(1.0, self.samples / max(1.0, c.driving_until * c.samples))
        return c.driving[0] + (c.driving[1] - c.driving[0]) * part

    @property
    def rests(self) -> tuple[int, ...]:
        """After how many labels the learning rate has fallen, and what was learnt is worth judging: at the ends of rounds."""
        c, fresh = self.config, self.config.steps_per_env * self.task.envs
        return tuple(math.ceil(share * c.samples / fresh) * fresh for share in (c.rests if self.begun else (1.0,)))

    def _rate(self) -> float:
        """The learning rate: from the higher to the lower on the way to the next rest."""
        low, high = self.config.rate
        behind = max((rest for rest in self.rests if rest < self.samples), default=0)
        ahead = min((rest for rest in self.rests if rest >= self.samples), default=self.samples)
        part = (self.samples - behind) / (ahead - behind)
        return low + (high - low) * 0.5 * (1.0 + math.cos(math.pi * part))

    def _acts(self, seen: Float[ndarray, "N A"]) -> Float[ndarray, "N J"]:
        with torch.inference_mode():
            groups = TensorDict({"policy": torch.as_tensor(seen)}, batch_size=[len(seen)])
            return np.asarray(self.actor(groups).numpy(), dtype=np.float64)

    def _remember(self, seen: Float[ndarray, "N A"], advice: Float[ndarray, "N J"]) -> None:
        self._labels[self.samples : self.samples + len(seen)] = np.concatenate((seen, advice), axis=1)
        self.samples += len(seen)

    def judged(self, score: float) -> None:
        """Keep the pupil as it is now, if no judgement before was better."""
        if score >= self._best_score:
            self._best = {name: value.clone() for name, value in self.actor.state_dict().items()}
            self._best_score = score

    def keep_best(self) -> None:
        """Put the pupil back to where it was judged best."""
        if self._best:
            self.actor.load_state_dict(self._best)

    def begin_anew(self) -> None:
        """Put all robots elsewhere: what follows depends on `state_dict` alone."""
        self._begin_some_anew(np.ones(self.task.envs, dtype=bool))

    def state_dict(self) -> dict[str, Any]:
        """All that a resumed run needs besides the file of labels, in tensors and plain values."""
        generators = {"own": self.rng.bit_generator.state, "task": self.task.rng.bit_generator.state}
        return {
            "actor": self.actor.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "samples": self.samples,
            "columns": self._columns.tolist(),
            "best": self._best,
            "best_score": self._best_score,
            "begun": self.begun,
            "generators": json.dumps(generators),
            "pushes": torch.from_numpy(self.task.pushes.wait.copy()),
            "starts": {name: torch.from_numpy(value.copy()) for name, value in self.task.starts.state_dict().items()},
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from a saved state.

        Raises:
            ValueError: it is another network's.
        """
        if state["columns"] != self._columns.tolist():
            raise ValueError(f"{state['columns']} numbers instead of {self._columns.tolist()}")
        self._best, self._best_score = state["best"], state["best_score"]
        self.begun = state.get("begun", False)
        self.actor.load_state_dict(state["actor"])
        self._optimiser.load_state_dict(state["optimiser"])
        self.samples, generators = state["samples"], json.loads(state["generators"])
        self.task.pushes.wait[:] = state["pushes"].numpy()
        self.task.starts.load_state_dict({name: value.numpy().copy() for name, value in state["starts"].items()})
        self.rng.bit_generator.state, self.task.rng.bit_generator.state = generators["own"], generators["task"]
        self.begin_anew()

    def _begin_some_anew(self, ended: Bool[ndarray, "N"]) -> None:
        ids = np.flatnonzero(ended)
        if len(ids):
            self.task.reset(ids)
            self.adviser.restart(ids)
            self._age[ids] = 0.0
            self._driven[ids] = self.rng.random(len(ids)) < self.driving

    def _learn(self) -> None:
        c, fresh, size = self.config, self.config.steps_per_env * self.task.envs, int(self._columns[0])
        part = min(1.0, self.samples / c.samples)
        if part < c.driving_until and not self.begun:  # what comes later is seen through the same glasses
            self.actor.train()
            self.actor.obs_normalizer.update(
                torch.from_numpy(self._labels[self.samples - fresh : self.samples, :size].astype(np.float32))
            )
            self.actor.eval()
        for group in self._optimiser.param_groups:
            group["lr"] = self._rate()
        losses = []
        for _ in range(max(1, round(c.passes * fresh / c.batch))):
            chosen = self._labels[self.rng.integers(0, self.samples, size=c.batch)]
            label = torch.from_numpy(chosen.astype(np.float32))
            groups = TensorDict({"policy": label[:, :size]}, batch_size=[c.batch])
            loss = ((self.actor(groups) - label[:, size:]) ** 2).mean()
            self._optimiser.zero_grad()
            loss.backward()
            self._optimiser.step()
            losses.append(float(loss.detach()))
        self.loss = float(np.mean(losses))
