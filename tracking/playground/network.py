"""A policy's network as layers that a page can compute: dense ones, what comes before them and after."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from tracking.errors import TrackingError

Layer = dict[str, Any]


def layers_of(path: Path) -> list[Layer]:
    """The layers of an ONNX, in order.

    Raises:
        TrackingError: it has others than these, or branches.
    """
    import onnx

    graph = onnx.load(str(path)).graph
    tables = {t.name: np.asarray(onnx.numpy_helper.to_array(t), dtype=np.float32) for t in graph.initializer}
    layers, flows = [], graph.input[0].name
    for node in graph.node:
        given = [tables[name] for name in node.input if name in tables]
        if node.input[0] != flows or node.op_type not in _LAYERS or len(given) != len(node.input) - 1:
            raise TrackingError(
                str(path), found=f"{node.op_type}, node {node.name}", expected=f"layers one after another, of {', '.join(_LAYERS)}",
                cure="show it with dance-view, where Python computes it",
            )  # fmt: skip
        layers.append(_LAYERS[node.op_type](*given))
        flows = node.output[0]
    return _joined(layers)


def _dense(weight: ndarray, bias: ndarray) -> Layer:
    return {"kind": "dense", "weight": weight, "bias": bias}


def _scaled(shift: ndarray, scale: ndarray) -> Layer:
    return {"kind": "affine", "shift": shift.ravel(), "scale": scale.ravel()}


_LAYERS: dict[str, Callable[..., Layer]] = {
    "Sub": lambda mean: _scaled(mean, np.ones_like(mean)),
    "Div": lambda std: _scaled(np.zeros_like(std), std),
    "Gemm": _dense,
    "Elu": lambda: {"kind": "elu"},
    "Tanh": lambda: {"kind": "tanh"},
    "Relu": lambda: {"kind": "relu"},
}


def _joined(layers: list[Layer]) -> list[Layer]:
    """Shift and scale, which come one by one, as one layer."""
    out: list[Layer] = []
    for layer in layers:
        before = out[-1] if out else {}
        if layer["kind"] == "affine" and before.get("kind") == "affine" and not layer["shift"].any():
            out[-1] = _scaled(before["shift"], before["scale"] * layer["scale"])
        else:
            out.append(layer)
    return out
