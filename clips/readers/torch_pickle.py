"""Torch's tensors in a plain pickle, as PHC writes them: rebuilt as arrays, without torch and without running anything."""

from __future__ import annotations

import io
import math
import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from robot_models.incoming import MAX_UNPACKED

_MAGIC = 0x1950A86A20F9469CFC6C  # of torch.save before its archives, which a storage is pickled by
_KINDS = {
    "FloatStorage": "<f4", "DoubleStorage": "<f8", "LongStorage": "<i8", "IntStorage": "<i4", "ShortStorage": "<i2",
    "CharStorage": "i1", "ByteStorage": "u1", "BoolStorage": "?", "HalfStorage": "<f2",
}  # fmt: skip


class _Kind:
    """A storage's class, which a pickle may name but not call."""

    def __init__(self, dtype: str) -> None:
        self.dtype = np.dtype(dtype)


class _Storage(pickle.Unpickler):
    """One of the five pickles that a storage consists of: plain values, and names of kinds of storage."""

    def find_class(self, module: str, name: str) -> Any:
        if module in ("torch", "torch.storage") and name in _KINDS:
            return _Kind(_KINDS[name])
        if (module, name) == ("collections", "OrderedDict"):
            return dict
        raise ValueError(f"a storage that names {module}.{name}")

    def persistent_load(self, pid: Any) -> Any:
        word, kind, key, _, size, *_ = pid
        if word != "storage" or not isinstance(kind, _Kind):
            raise ValueError("a storage of another kind")
        return kind.dtype, str(key), int(size)


def load_storage(data: Any) -> ndarray:
    """`torch.storage._load_from_bytes`: numbers in a row.

    Raises:
        ValueError: other bytes than torch.save writes, or fewer than they say.
    """
    if not isinstance(data, bytes):
        raise ValueError("a storage that is no bytes")
    stream = io.BytesIO(data)
    if _Storage(stream).load() != _MAGIC:
        raise ValueError("a storage without torch's magic number")
    for _ in range(2):  # version, and what the machine is like
        _Storage(stream).load()
    dtype, key, size = _Storage(stream).load()
    if [str(k) for k in _Storage(stream).load()] != [key]:
        raise ValueError("a storage of several parts")
    rest = stream.read()
    (count,) = np.frombuffer(rest[:8], "<i8")
    if count != size or len(rest) - 8 < size * dtype.itemsize:
        raise ValueError(f"a storage of {size} numbers in {len(rest)} bytes")
    return np.frombuffer(rest, dtype, count=size, offset=8)


def rebuild_tensor(storage: Any, offset: Any, size: Any, stride: Any, *_: Any) -> ndarray:
    """`torch._utils._rebuild_tensor_v2`: a view of a storage.

    Raises:
        ValueError: a view beyond its storage.
    """
    shape, steps = tuple(map(int, size)), tuple(map(int, stride))
    if (
        not isinstance(storage, ndarray)
        or len(shape) != len(steps)
        or min((*shape, *steps, int(offset)), default=0) < 0
    ):
        raise ValueError("a tensor of no storage")
    last = int(offset) + sum((n - 1) * s for n, s in zip(shape, steps, strict=True))
    if math.prod(shape) * storage.itemsize > MAX_UNPACKED:  # strides of 0 make much of little
        raise ValueError(f"a tensor of shape {shape}")
    if math.prod(shape) and last >= len(storage):
        raise ValueError(f"a tensor of shape {shape} over {len(storage)} numbers")
    strides = [s * storage.itemsize for s in steps]
    return np.lib.stride_tricks.as_strided(storage[int(offset) :], shape, strides).copy()


REBUILDERS: Sequence[tuple[tuple[str, str], Callable[..., ndarray]]] = (
    (("torch.storage", "_load_from_bytes"), load_storage),
    (("torch._utils", "_rebuild_tensor_v2"), rebuild_tensor),
)
