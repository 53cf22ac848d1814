"""Exported networks as functions of observations, by onnxruntime on one thread."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from tracking.errors import TrackingError

Policy = Callable[[Float[ndarray, "N A"]], Float[ndarray, "N J"]]
"""Observations to mean actions."""


def onnx_policy(path: Path, observation: int | None = None, actions: int | None = None) -> Policy:
    """The mean action of an exported actor, by onnxruntime on one thread.

    Args:
        path: the network, input `obs`, output `actions`.
        observation: how many numbers it shall take.
        actions: how many it shall give.

    Raises:
        TrackingError: not a network, or not of these sizes.
    """
    session = open_onnx(path)
    for name, given, wanted in (
        ("observation", session.get_inputs()[0].shape[-1], observation),
        ("actions", session.get_outputs()[0].shape[-1], actions),
    ):
        if wanted is not None and given != wanted:
            raise TrackingError(f"{path}, {name}", found=f"{given} numbers", expected=f"{wanted}, as in the contract")

    def act(observation: np.ndarray) -> np.ndarray:
        return np.asarray(session.run(["actions"], {"obs": observation})[0], dtype=np.float64)

    return act


def open_onnx(path: Path) -> Any:
    """An ONNX network, on one thread.

    Raises:
        TrackingError: onnxruntime refuses it.
    """
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as e:  # onnxruntime's own exception types are not public
        raise TrackingError(
            str(path), found="a file that onnxruntime refuses", expected="policy.onnx of a bundle"
        ) from e
