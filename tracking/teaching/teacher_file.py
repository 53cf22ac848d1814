"""A teacher on disk, `teacher.pt`: networks, optimiser and statistics, so that its own optimisation can go on."""

from __future__ import annotations

import io
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDict

from clips import write_whole
from tracking.config import TeacherConfig
from tracking.errors import TrackingError
from tracking.task import TrackingTask
from tracking.teaching.teacher import SymmetricActor, TeacherTrainer, teacher_network

FORMAT_VERSION = 2


@dataclass(frozen=True, kw_only=True)
class Teacher:
    """A teacher as it was read."""

    robot: str
    robot_hash: str
    control_dt: float  # [s]
    rows: tuple[str, ...]  # what it sees, in order
    steps: int  # control steps that it has learnt for
    state: dict[str, Any]  # of the algorithm
    config: TeacherConfig  # sizes and rates as it was begun with

    @property
    def can_learn(self) -> bool:
        """Whether its critic and optimiser are in the file, without which it can only be played."""
        return "critic_state_dict" in self.state


def save_teacher(path: Path, trainer: TeacherTrainer, steps: int, *, optimiser: bool = True) -> None:
    """Write a teacher, whole or not at all; without its optimiser it is a third of the size, and can only be played."""
    task, state = trainer.task, trainer.algorithm.save()
    if not optimiser:
        state = {"actor_state_dict": state["actor_state_dict"]}
    told = {
        "format_version": FORMAT_VERSION,
        "robot": task.robot.name,
        "robot_hash": task.robot.hash,
        "control_dt": task.dt,
        "rows": json.dumps(_rows(trainer.task)),
        "steps": steps,
        "config": json.dumps(asdict(trainer.teacher), sort_keys=True),
        "algorithm": state,
    }
    content = io.BytesIO()
    torch.save(told, content)  # to memory first: on a full disk torch names no disk
    with write_whole(path) as stream:
        stream.write(content.getbuffer())


def load_teacher(path: Path) -> Teacher:
    """Read a teacher; only tensors and plain values are unpickled.

    Raises:
        TrackingError: no such file, no teacher, or another version.
    """
    try:
        told: dict[str, Any] = torch.load(path, weights_only=True, map_location="cpu")
        version = told["format_version"] if "rows" in told else None
    except FileNotFoundError as e:
        raise TrackingError(str(path), found="no such file", expected="a teacher") from e
    except Exception as e:  # torch raises a different type for every way in which a file can be broken
        raise TrackingError(str(path), found=f"a file that is no teacher ({type(e).__name__})", expected="one") from e
    if version != FORMAT_VERSION:
        raise TrackingError(str(path), found="another format", expected=f"teacher version {FORMAT_VERSION}")
    return Teacher(
        robot=told["robot"], robot_hash=told["robot_hash"], control_dt=told["control_dt"],
        rows=tuple(json.loads(told["rows"])), steps=told["steps"], state=told["algorithm"],
        config=_config(json.loads(told["config"])),
    )  # fmt: skip


def restore_teacher(trainer: TeacherTrainer, teacher: Teacher) -> None:
    """Let a trainer go on from a teacher; without a critic in it, only its actor is taken.

    Raises:
        TrackingError: another robot's, or one that sees other things.
    """
    _check(teacher, trainer.task)
    algorithm = trainer.algorithm
    if not teacher.can_learn:
        algorithm.load(teacher.state, {"actor": True}, strict=True)
        return
    of_actor = len(list(algorithm.actor.parameters()))
    algorithm.load(teacher.state | {"optimizer_state_dict": _by_network(teacher.state, of_actor)}, None, strict=True)
    algorithm.optimizer.param_groups[1]["lr"] = trainer.teacher.critic_rate


def _by_network(state: dict[str, Any], of_actor: int) -> dict[str, Any]:
    """The optimiser's state with a group for the actor and one for the critic; files before 0.2 have one for both."""
    optimiser: dict[str, Any] = state["optimizer_state_dict"]
    if len(optimiser["param_groups"]) > 1:
        return optimiser
    (group,) = optimiser["param_groups"]
    both = [group | {"params": part} for part in (group["params"][:of_actor], group["params"][of_actor:])]
    return optimiser | {"param_groups": both}


def teacher_actor(teacher: Teacher, task: TrackingTask) -> SymmetricActor:
    """A teacher's actor, for the robots of a task.

    Raises:
        TrackingError: another robot's, or one that sees other things.
    """
    _check(teacher, task)
    groups = TensorDict({"policy": torch.as_tensor(task.observe_all()[0])}, batch_size=[task.envs])
    noise = {"class_name": "rsl_rl.modules:GaussianDistribution", "init_std": 1.0, "std_type": "log"}
    actor: SymmetricActor = teacher_network(task)(
        groups, {"actor": ["policy"]}, "actor", task.actions, hidden_dims=list(teacher.config.ppo.hidden), activation="elu",
        obs_normalization=True, distribution_cfg=noise,
    )  # fmt: skip
    actor.load_state_dict(teacher.state["actor_state_dict"])
    return actor.eval()


def _config(told: dict[str, Any]) -> TeacherConfig:
    """Of what is told only the sizes: rates and schedules are this release's."""
    base = TeacherConfig()
    ppo = replace(base.ppo, **{name: _size(told["ppo"][name]) for name in ("hidden", "steps_per_env", "minibatches")})
    return replace(base, envs=told["envs"], critic_hidden=_size(told["critic_hidden"]), ppo=ppo)


def _size(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _check(teacher: Teacher, task: TrackingTask) -> None:
    robot = task.robot
    if (teacher.robot, teacher.robot_hash) != (robot.name, robot.hash):
        raise TrackingError("teacher", found=f"one of {teacher.robot}", expected=f"{robot.name} as it is now")
    if teacher.control_dt != task.dt:
        raise TrackingError(
            "teacher", found=f"one that acts {1.0 / teacher.control_dt:g} times a second", expected=f"{1.0 / task.dt:g}",
            cure=f"retarget the clip at {1.0 / teacher.control_dt:g} frames per second",
        )  # fmt: skip
    if list(teacher.rows) != _rows(task):
        raise TrackingError("teacher", found="one that sees other things than this release's", expected="the same rows")


def _rows(task: TrackingTask) -> list[str]:
    return [f"{row.name} {row.size}" for row in task.teacher.rows]
