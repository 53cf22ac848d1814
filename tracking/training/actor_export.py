"""A trained actor as a bundle: `policy.onnx` and `contract.json`, checked against torch before it is kept."""

from __future__ import annotations

import hashlib
import tempfile
import warnings
from contextlib import closing
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy import ndarray

from clips import Reference, write_whole
from robot_models.maths import to_numpy
from tracking.config import RandomisationConfig
from tracking.errors import TrackingError
from tracking.policy import (
    FROM_REFERENCE,
    OF_ROBOT,
    Contract,
    Golden,
    Policy,
    anchor_chain,
    onnx_policy,
    standing_gains,
    target_range,
    write_contract,
    write_golden,
)
from tracking.task import NamedReference, TrackingTask

_AGREEMENT = 1e-5  # largest difference of onnxruntime and torch


def torch_policy(actor: Any) -> Policy:
    """The mean action of an actor network as a numpy function."""
    from tensordict import TensorDict

    device = next(actor.parameters()).device

    def act(observation: np.ndarray) -> np.ndarray:
        actor.eval()
        with torch.inference_mode():
            seen = torch.from_numpy(observation).to(device)
            groups = TensorDict({"policy": seen}, batch_size=[len(observation)], device=device)
            return np.asarray(actor(groups).cpu().numpy(), dtype=np.float64)

    return act


def export_bundle(folder: Path, actor: Any, task: TrackingTask, piece: NamedReference) -> float:
    """Write a piece's bundle; returns the largest difference between onnxruntime and torch on real observations.

    Raises:
        TrackingError: the actor sees something that no robot measures, the export disagrees with torch, or the piece's
            file has changed.
    """
    difference = _write_policy(folder, actor, task)
    _copy_reference(piece, folder / "reference.npz")
    write_contract(folder / "contract.json", contract_of(task, piece.sha256))
    write_golden(folder / "golden.npz", record(onnx_policy(folder / "policy.onnx"), task, piece.reference))
    return difference


def _write_policy(folder: Path, actor: Any, task: TrackingTask) -> float:
    """Write the network, checked against torch before it is kept."""
    hidden = [t.name for t in task.actor.rows if not t.measurable]
    if hidden:
        raise TrackingError("export", found=f"an actor that sees {', '.join(hidden)}", expected="measurable terms only")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as aside:
        path = Path(aside) / "policy.onnx"
        model = actor.as_onnx(verbose=False).cpu().eval()  # a copy, normaliser and network
        _write_onnx(model, task.actor.size, path)

        def policy(observation: ndarray) -> ndarray:
            with torch.inference_mode():
                return np.asarray(model(torch.from_numpy(observation)).numpy(), dtype=np.float64)

        observation = to_numpy(task.observe()[0])
        difference = float(np.abs(onnx_policy(path)(observation) - policy(observation)).max())
        if not difference < _AGREEMENT:
            raise TrackingError(
                "export", found=f"actions {difference:.2g} apart from torch", expected=f"< {_AGREEMENT}"
            )
        path.replace(folder / "policy.onnx")
    return difference


def export_tracker(folder: Path, actor: Any, task: TrackingTask) -> float:
    """Write an actor as a tracker: a bundle without a reference of its own; returns as `export_bundle`."""
    difference = _write_policy(folder, actor, task)
    write_contract(folder / "contract.json", contract_of(task, ""))
    return difference


def _copy_reference(piece: NamedReference, path: Path) -> None:
    content = piece.path.read_bytes()
    if hashlib.sha256(content).hexdigest() != piece.sha256:
        raise TrackingError(
            str(piece.path), found="another file than the run began with", expected="it unchanged while it is trained on",
            cure="put the old one back, then resume",
        )  # fmt: skip
    with write_whole(path) as stream:
        stream.write(content)


def record(policy: Policy, like: TrackingTask, reference: Reference, seconds: float = 2.0) -> Golden:
    """The trainer's own road through the first seconds of a dance: nominal robot, start noise, exact sensors."""
    task = TrackingTask(
        robot=like.robot, reference=reference, envs=1, threads=1,
        config=replace(like.config, randomisation=RandomisationConfig(enabled=False)),
    )  # fmt: skip
    rows: list[dict[str, ndarray]] = []
    with closing(task):
        task.reset(np.array([0]), np.array([reference.dance.start]))
        for _ in range(min(round(seconds / task.dt), reference.frames - 2)):
            now, seen = task.measured(noisy=False), task.observe(noisy=False)[0]
            action = policy(seen)
            result = task.step(action)
            row = {name: getattr(now, name) for name in ("quat", "gyro", "joint_pos", "joint_vel")}
            row |= {"observation": seen, "action": action, "target": task.physics.targets[:, 0]}
            rows.append({name: np.array(value[0]) for name, value in row.items()})  # copies of the running state
            if result.terminated[0]:
                break
    return Golden(**{name: np.stack([row[name] for row in rows]) for name in rows[0]})


def contract_of(task: TrackingTask, reference_sha256: str) -> Contract:
    """Everything that a runner must know, at full precision."""
    robot, draw = task.robot, task.config.randomisation
    lower, upper = target_range(robot, robot.lower, robot.upper)
    stand_kp, stand_kd = standing_gains(robot)
    return Contract(
        robot=robot.name,
        robot_hash=robot.hash,
        reference_sha256=reference_sha256,
        control_dt=task.dt,
        **{name: getattr(robot, name) for name in ("joint_names", *OF_ROBOT)},
        stand_kp=stand_kp,
        stand_kd=stand_kd,
        action_scale=task.config.action_scale * robot.effort / robot.kp,
        target=FROM_REFERENCE,
        target_lower=lower,
        target_upper=upper,
        anchor=robot.profile.anchor,
        anchor_chain=anchor_chain(robot, robot.profile.anchor),
        observation=task.actor.rows,
        delay_trained_with_s=draw.delay if draw.enabled else (0.0, 0.0),
        versions={p: version(p) for p in ("torch", "rsl-rl-lib", "mujoco", "onnx", "numpy")},
    )


def _write_onnx(model: torch.nn.Module, size: int, path: Path) -> None:
    with warnings.catch_warnings():
        # torch marks its TorchScript exporter as legacy; it writes one file, and needs no further packages.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            model, (torch.zeros(1, size),), str(path), input_names=["obs"], output_names=["actions"], opset_version=18,
            dynamo=False, dynamic_axes={"obs": {0: "batch"}, "actions": {0: "batch"}},
        )  # fmt: skip
