"""Exported networks as functions of observations, by onnxruntime on one thread."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.incoming import MAX_NETWORK, refusal_of_child, regular_file
from tracking.errors import TrackingError

_OURS = (Path(__file__).parents[1] / "policies").resolve()
# Opens and runs a network on the smallest input, on some numbers: it has to end, in so much memory, with numbers.
_TRY = """
import numpy as np, onnxruntime
options = onnxruntime.SessionOptions()
options.intra_op_num_threads = options.inter_op_num_threads = 1
options.log_severity_level = 4
session = onnxruntime.InferenceSession(sys.argv[1], options, providers=["CPUExecutionProvider"])
kinds = {"tensor(float)": np.float32, "tensor(int64)": np.int64, "tensor(int32)": np.int32}
for value in (0.0, 1.0, -1.0):
    feeds = {}
    for entry in session.get_inputs():
        if entry.type not in kinds:
            sys.exit(f"an input of {entry.type}")
        shape = [n if isinstance(n, int) else 1 for n in entry.shape]
        feeds[entry.name] = np.full(shape, abs(value) if "step" in entry.name else value, kinds[entry.type])
    for entry, out in zip(session.get_outputs(), session.run(None, feeds)):
        if not np.isfinite(np.asarray(out, dtype=float)).all():
            sys.exit(f"output {entry.name} that is not finite")
"""
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
    inputs, outputs = ({x.name: x.shape for x in some} for some in (session.get_inputs(), session.get_outputs()))
    if set(inputs) != {"obs"} or "actions" not in outputs:
        found = f"inputs {', '.join(inputs) or 'none'}, outputs {', '.join(outputs)}"
        raise TrackingError(str(path), found=found[:200], expected="an input obs and an output actions")
    for name, shape, wanted in (("observation", inputs["obs"], observation), ("actions", outputs["actions"], actions)):
        if len(shape) != 2 or (wanted is not None and shape[-1] != wanted):
            found = f"{shape[-1]} numbers" if len(shape) == 2 else f"shape {shape}"
            raise TrackingError(
                f"{path}, {name}", found=found, expected=f"{wanted or 'rows of'} numbers, as in the contract"
            )

    def act(observation: np.ndarray) -> np.ndarray:
        return np.asarray(session.run(["actions"], {"obs": observation})[0], dtype=np.float64)

    return act


def open_onnx(path: Path) -> Any:
    """An ONNX network, on one thread.

    Raises:
        TrackingError: onnxruntime refuses it.
    """
    import onnxruntime

    regular_file(path, expected="policy.onnx of a bundle", most=MAX_NETWORK, error=TrackingError)
    if not path.resolve().is_relative_to(_OURS):
        written = path.stat()
        complaint = _tried(str(path), written.st_mtime_ns, written.st_size)
        if complaint:
            raise TrackingError(
                str(path), found=f"a file that onnxruntime comes to grief over ({complaint})",
                expected="policy.onnx of a bundle",
            )  # fmt: skip
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as e:  # onnxruntime's own exception types are not public
        raise TrackingError(
            str(path), found="a file that onnxruntime refuses", expected="policy.onnx of a bundle"
        ) from e


@lru_cache(maxsize=64)
def _tried(path: str, _written: int, _size: int) -> str:
    """Why a network came to grief in a process of its own; asked once of each file, however often it is opened."""
    return refusal_of_child(_TRY, [path])
