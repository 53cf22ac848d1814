"""NumPy's arrays and torch's tensors under one name: a formula written once runs on both, and on any device.

torch understands numpy's argument names (`axis`, `keepdims`), and what has one name in both libraries is called through
`array_namespace`. Nothing here imports torch: whoever hands in a tensor has done so.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

Array = Any  # numpy's ndarray, or a torch tensor on any device


def array_namespace(array: Array) -> Any:
    """The library that an array belongs to."""
    if isinstance(array, (np.ndarray, np.generic)) or not hasattr(array, "device"):
        return np
    return sys.modules["torch"]


def room_beside(first: Array, count: int) -> Array:
    """Room for a result along a new last axis, of which the first entries stand there already."""
    out = (np.empty if array_namespace(first) is np else first.new_empty)((*first.shape, count))
    out[..., 0] = first
    return out


def to_numpy(array: Array) -> np.ndarray:
    """The same numbers as numpy's array, brought from the device where they are on one."""
    return np.asarray(array) if array_namespace(array) is np else np.asarray(array.detach().cpu())


def push_history(past: Array, now: Array) -> None:
    """Move what lies along the first axis one place on, in place, and put the newest in front."""
    for k in range(len(past) - 1, 0, -1):  # torch does not move a tensor onto itself
        past[k] = past[k - 1]
    past[0] = now
