"""A trained actor as a bundle: `policy.onnx` and `contract.json`, checked against torch before it is kept."""

from __future__ import annotations

import json
import tempfile
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch

from clips.files import write_whole
from robot_models import RobotModel
from tracking.config import TaskConfig
from tracking.errors import TrackingError
from tracking.evaluation import Policy
from tracking.task import TrackingTask

_AGREEMENT = 1e-5  # largest difference of onnxruntime and torch


def torch_policy(actor: Any) -> Policy:
    """The mean action of an actor network as a numpy function."""
    from tensordict import TensorDict

    def act(observation: np.ndarray) -> np.ndarray:
        actor.eval()
        with torch.inference_mode():
            groups = TensorDict({"policy": torch.from_numpy(observation)}, batch_size=[len(observation)])
            return np.asarray(actor(groups).numpy(), dtype=np.float64)

    return act


def onnx_policy(path: Path) -> Policy:
    """The mean action of an exported actor, by onnxruntime."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    try:
        session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as e:  # onnxruntime's own exception types are not public
        raise TrackingError(
            str(path), found="a file that onnxruntime refuses", expected="policy.onnx of a bundle"
        ) from e

    def act(observation: np.ndarray) -> np.ndarray:
        return np.asarray(session.run(["actions"], {"obs": observation})[0], dtype=np.float64)

    return act


def export_bundle(folder: Path, actor: Any, task: TrackingTask, reference_sha256: str) -> float:
    """Write the bundle; returns the largest difference between onnxruntime and torch on real observations.

    Raises:
        TrackingError: the actor sees something that no robot measures, or the export disagrees with torch.
    """
    hidden = [t.name for t in task.actor.terms if not t.measurable]
    if hidden:
        raise TrackingError("export", found=f"an actor that sees {', '.join(hidden)}", expected="measurable terms only")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as aside:
        path = Path(aside) / "policy.onnx"
        _write_onnx(actor, task.actor.size, path)
        observation, _ = task.observe()
        difference = float(np.abs(onnx_policy(path)(observation) - torch_policy(actor)(observation)).max())
        if not difference < _AGREEMENT:
            raise TrackingError(
                "export", found=f"actions {difference:.2g} apart from torch", expected=f"< {_AGREEMENT}"
            )
        path.replace(folder / "policy.onnx")
    with write_whole(folder / "contract.json") as stream:
        stream.write(json.dumps(contract(task, reference_sha256), indent=1).encode())
    return difference


def contract(task: TrackingTask, reference_sha256: str) -> dict[str, Any]:
    """Everything that a runner must know, at full precision."""
    robot, draw = task.robot, task.config.randomisation
    return {
        "format_version": 1,
        "robot": robot.name,
        "robot_hash": robot.hash,
        "reference_sha256": reference_sha256,
        "control_dt": task.dt,
        "joint_names": list(robot.joint_names),
        "default_joint_pos": robot.default_joint_pos.tolist(),
        "kp": robot.kp.tolist(),
        "kd": robot.kd.tolist(),
        "effort": robot.effort.tolist(),
        "action_scale": task.action_scale.tolist(),
        "action_meaning": "servo target = joint_target of the next frame + action_scale * action, within target_range",
        "joint_target": "middle of the period: joint_pos + (joint_torque + kd * joint_vel) / kp",
        "target_range": [limit.tolist() for limit in task.target_range],
        "anchor": robot.profile.anchor,
        "look_ahead": list(task.config.look_ahead),
        "look_back": list(task.config.look_back),
        "observation": task.actor.as_rows(),
        "delay_trained_with_s": list(draw.delay) if draw.enabled else [0.0, 0.0],
        "versions": {p: version(p) for p in ("torch", "rsl-rl-lib", "mujoco", "onnx", "numpy")},
    }


def check_contract(told: dict[str, Any], robot: RobotModel, config: TaskConfig, reference_sha256: str) -> None:
    """Refuse to run a policy on anything but what it was trained for.

    Raises:
        TrackingError: another reference, robot, joint order, gain, action scale or observation than the contract's.
    """
    now = {
        "reference_sha256": reference_sha256,
        "robot_hash": robot.hash,
        "joint_names": list(robot.joint_names),
        "kp": robot.kp.tolist(),
        "kd": robot.kd.tolist(),
        "effort": robot.effort.tolist(),
        "action_scale": (config.action_scale * robot.effort / robot.kp).tolist(),
        "default_joint_pos": robot.default_joint_pos.tolist(),
        "look_ahead": list(config.look_ahead),
        "look_back": list(config.look_back),
    }
    for key, value in now.items():
        if told.get(key) != value:
            raise TrackingError(
                f"contract, {key}", found=_short(told.get(key)), expected=f"{_short(value)}, as it is now",
                cure="use the reference and robot that the policy was trained with, or train again",
            )  # fmt: skip


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) < 60 else f"{text[:57]}..."


def _write_onnx(actor: Any, size: int, path: Path) -> None:
    model = actor.as_onnx(verbose=False).eval()
    with warnings.catch_warnings():
        # torch marks its TorchScript exporter as legacy; it writes one file, and needs no further packages.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            model, (torch.zeros(1, size),), str(path), input_names=["obs"], output_names=["actions"], opset_version=18,
            dynamo=False, dynamic_axes={"obs": {0: "batch"}, "actions": {0: "batch"}},
        )  # fmt: skip
