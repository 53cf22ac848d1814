"""One file from which a training run goes on exactly: networks, optimiser, normalisers, generators, environments."""

from __future__ import annotations

import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch

from clips import write_whole
from robot_models.maths import to_numpy
from tracking.config import TrainConfig
from tracking.errors import TrackingError
from tracking.run_files import CHECKPOINT
from tracking.training.actor_import import begin_with
from tracking.training.ppo import Trainer

FORMAT_VERSION = 2


def save_checkpoint(
    path: Path, trainer: Trainer, config: TrainConfig, reference_sha256: str, progress: dict[str, Any]
) -> None:
    """Write the whole state of a run aside, then rename; every process of a team tells, and the leader writes."""
    mine = {
        "torch_rng": _generator(trainer).get_state(),
        "age": torch.from_numpy(to_numpy(trainer.age).copy()),
        "task": _packed(trainer.task.state_dict()),
        "critic_alone": trainer.critic_alone,
    }
    processes = trainer.team.gather(mine)
    if not trainer.team.is_leader:
        return
    state = {
        "format_version": FORMAT_VERSION,
        "algorithm": trainer.algorithm.save(),
        "processes": processes,
        "config": json.dumps(asdict(config), sort_keys=True),
        "reference_sha256": reference_sha256,
        "progress": json.dumps(progress),
    }
    content = io.BytesIO()
    torch.save(state, content)  # to memory first: on a full disk torch names no disk
    with write_whole(path) as stream:
        stream.write(content.getbuffer())


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Read a checkpoint; only tensors and plain values are unpickled.

    Raises:
        TrackingError: no such file, not a checkpoint, or another version.
    """
    try:
        state: dict[str, Any] = torch.load(path, weights_only=True, map_location="cpu")
    except FileNotFoundError as e:
        raise TrackingError(str(path), found="no such file", expected="a checkpoint") from e
    except Exception as e:  # torch raises a different type for every way in which a file can be broken
        raise TrackingError(
            str(path), found=f"a file that is no checkpoint ({type(e).__name__})", expected="one"
        ) from e
    if not isinstance(state, dict) or state.get("format_version") != FORMAT_VERSION:
        raise TrackingError(str(path), found="another format", expected=f"checkpoint version {FORMAT_VERSION}")
    return state


def restore(trainer: Trainer, state: dict[str, Any], config: TrainConfig, reference_sha256: str) -> dict[str, Any]:
    """Put a trainer into a saved state; returns the saved progress.

    Raises:
        TrackingError: the run was another task, network or reference.
    """
    if state["reference_sha256"] != reference_sha256:
        raise TrackingError(
            "resume", found=f"a run on reference {state['reference_sha256'][:12]}", expected=f"{reference_sha256[:12]}",
            cure="resume with the reference that the run began with",
        )  # fmt: skip
    then, now = json.loads(state["config"]), json.loads(json.dumps(asdict(config)))
    for key in ("task", "envs", "seed", "threads", "engine"):
        if then[key] != now[key]:
            raise TrackingError("resume", found=f"another {key} than the run began with", expected=f"{then[key]}")
    shapes = ("hidden", "steps_per_env")  # rates, schedules and weights of the loss may change on purpose
    for key in shapes:
        if then["ppo"][key] != now["ppo"][key]:
            raise TrackingError("resume", found=f"another {key} ({now['ppo'][key]})", expected=f"{then['ppo'][key]}")
    if len(state["processes"]) != trainer.team.size:
        raise TrackingError(
            "resume",
            found=f"{trainer.team.size} processes",
            expected=f"{len(state['processes'])}, as the run began with",
        )
    mine = state["processes"][trainer.team.rank]
    trainer.algorithm.load(state["algorithm"], None, True)
    # The library saves its optimiser, but not the rate that it goes on adapting from.
    trainer.algorithm.learning_rate = trainer.algorithm.optimizer.param_groups[0]["lr"]
    _generator(trainer).set_state(mine["torch_rng"])
    trainer.age = trainer.task.physics.to_device(mine["age"].numpy().copy())
    trainer.task.load_state_dict(_unpacked(mine["task"]))
    trainer.critic_alone = mine.get("critic_alone", 0)
    progress: dict[str, Any] = json.loads(state["progress"])
    return progress


def begin_run(trainer: Trainer, policy: Path) -> None:
    """Let a new run begin with what another came to.

    Args:
        trainer: as it was made.
        policy: the folder of a run of PPO, whose critic and optimiser come along; or any bundle of the same robot, table and
            size, whose critic learns alone at first.

    Raises:
        TrackingError: no policy, or one of another robot, table or size.
    """
    begin_with(trainer.actor, policy, trainer.task)
    try:
        learnt = load_checkpoint(policy / CHECKPOINT)["algorithm"]
    except TrackingError:  # a bundle alone, or a run that was taught: nobody estimated returns there
        trainer.begin_with_critic()
        return
    trainer.algorithm.load(learnt, None, True)
    trainer.algorithm.learning_rate = trainer.algorithm.optimizer.param_groups[0]["lr"]


def _generator(trainer: Trainer) -> torch.Generator:
    """What the exploration's noise is drawn from: torch's own on the networks' device."""
    device = torch.device(trainer.task.physics.device)
    return torch.cuda.default_generators[device.index or 0] if device.type == "cuda" else torch.default_generator


def _packed(state: dict[str, Any]) -> dict[str, Any]:
    """Arrays as tensors and the generator's big integers as text, which torch reads back without unpickling code."""
    arrays = {k: torch.from_numpy(np.array(v)) for k, v in state.items() if k != "rng"}
    return {**arrays, "rng": json.dumps(state["rng"])}


def _unpacked(state: dict[str, Any]) -> dict[str, Any]:
    arrays = {k: v.numpy().copy() for k, v in state.items() if k != "rng"}
    return {**arrays, "rng": json.loads(state["rng"])}
