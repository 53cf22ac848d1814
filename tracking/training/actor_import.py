"""A policy's network back in torch, for a new one to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch

from tracking.errors import TrackingError, shortened
from tracking.policy import CONTRACT, POLICY, find_policy, onnx_policy, read_contract
from tracking.task import TrackingTask
from tracking.training.actor_export import contract_of, torch_policy

_SAME = ("robot", "robot_hash", "joint_names", "kp", "kd", "action_scale", "target", "control_dt", "observation")
_AGREEMENT = 1e-4  # largest difference of the network in torch from the one in the file, on noise
_SEEN = 1_000_000  # observations that a normaliser counts as seen: what comes later hardly moves it


def begin_with(actor: Any, policy: Path, task: TrackingTask) -> None:
    """Give an actor the weights of a policy, and its normaliser.

    Args:
        actor: rsl-rl's `MLPModel`.
        policy: a bundle, a tracker of ours, a run; or the name of one that comes with the package.
        task: the actor's.

    Raises:
        TrackingError: no bundle, or one of another robot, table or size.
    """
    wrong = misfit(actor, policy, task)
    if wrong:
        raise TrackingError(
            f"{policy}, to begin with", found=wrong, expected="a policy of this robot, table and size", cure="begin with nothing"
        )  # fmt: skip
    actor.load_state_dict(_weights(bundle_of(policy) / POLICY, actor))
    seen = np.random.default_rng(0).normal(size=(8, task.actor.size)).astype(np.float32)
    apart = float(np.abs(torch_policy(actor)(seen) - onnx_policy(bundle_of(policy) / POLICY)(seen)).max())
    if not apart < _AGREEMENT:
        raise TrackingError(
            f"{policy}, to begin with", found=f"a network that does {apart:.1g} else in torch", expected="one of ours"
        )


def misfit(actor: Any, policy: Path, task: TrackingTask) -> str:
    """Why an actor cannot begin with a policy; "" where it can.

    Raises:
        TrackingError: no bundle.
    """
    folder = bundle_of(policy)
    told, own = read_contract(folder / CONTRACT), contract_of(task, "")
    for name in _SAME:
        then, now = getattr(told, name), getattr(own, name)
        if np.shape(then) != np.shape(now) or not np.all(np.asarray(then) == np.asarray(now)):
            return f"another {name} ({shortened(then)})"
    weights, wanted = _weights(folder / POLICY, actor), actor.state_dict()
    for name in wanted:
        if weights[name].shape != wanted[name].shape:
            return f"{name} of {tuple(weights[name].shape)} where this one has {tuple(wanted[name].shape)}"
    return ""


def bundle_of(policy: Path) -> Path:
    """The folder of a policy's network and contract; of a run on several dances the first, for all have the same.

    Raises:
        TrackingError: there is none.
    """
    folder = find_policy(policy)
    inside = sorted(p.parent for p in folder.glob(f"*/{CONTRACT}"))
    found = folder if (folder / CONTRACT).is_file() or not inside else inside[0]
    if not (found / CONTRACT).is_file():
        raise TrackingError(str(policy), found="no bundle", expected="a policy of ours to begin with")
    return found


def _weights(network: Path, actor: Any) -> dict[str, torch.Tensor]:
    """The actor's state with everything that an exported network has of it."""
    import onnx

    graph = onnx.load(str(network)).graph
    tensors = {t.name: torch.from_numpy(onnx.numpy_helper.to_array(t).copy()) for t in graph.initializer}
    own: dict[str, torch.Tensor] = actor.state_dict()
    found = {name: tensors[name] for name in own if name in tensors}
    # The exporter folds the small number that keeps the normaliser from dividing by nothing into what it divides by.
    by = next(
        (tensors[node.input[1]] for node in graph.node if node.op_type == "Div" and node.input[1] in tensors), None
    )
    if by is not None:
        std = by - actor.obs_normalizer.eps
        found |= {
            "obs_normalizer._std": std, "obs_normalizer._var": std**2, "obs_normalizer.count": torch.tensor(_SEEN)
        }  # fmt: skip
    return {**own, **found}
