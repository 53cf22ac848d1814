"""Plain data out of a pickle without running a stranger's code.

The unpickler can rebuild numpy arrays and plain containers. Everything else that a pickle asks for is refused by
name before it is called.
"""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import math
import pickle
import re
import zlib
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from clips.errors import ClipError
from clips.provenance import RawFile
from clips.readers import torch_pickle
from robot_models.incoming import MAX_UNPACKED

_MULTIARRAY = ("numpy.core.multiarray", "numpy._core.multiarray")
_NUMERIC = ("numpy.core.numeric", "numpy._core.numeric")
# Element types of numbers and text; a pickle may name a type in no other way.
_TYPE = re.compile(r"[<>=|]?([?bhilqBHILQefdg]|[biufSU]\d{1,4})")
_MOST_VALUES = 50_000_000  # outside of arrays: lists of lists of an hour of a robot
_PART = 1 << 20  # bytes unpacked at a time


class _Zlib:
    """A zlib stream read in parts; joblib's default, and the one that Python has no file class for."""

    def __init__(self, data: io.BytesIO) -> None:
        self._packed, self._unpacker = data.getvalue(), zlib.decompressobj()

    def read(self, size: int) -> bytes:
        part = self._unpacker.decompress(self._packed, size)
        self._packed = self._unpacker.unconsumed_tail
        return part


OPENERS: dict[bytes, Callable[[io.BytesIO], Any]] = {
    b"\x1f\x8b": lambda f: gzip.GzipFile(fileobj=f),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ": lzma.LZMAFile,
    b"\x5d\x00": lzma.LZMAFile,
    # The second byte tells zlib from a text that begins with an x.
    **dict.fromkeys((b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda"), _Zlib),
}


def load(raw: RawFile, *, held: Collection[tuple[str, str]] = ()) -> Any:
    """Unpickle plain data; joblib's compressed and array-appending form too.

    Args:
        raw: the file.
        held: classes (module, name) whose objects are kept as the dictionaries that they consist of; files that have such are
            of Python 2, whose text and bytes are one.

    Raises:
        ClipError: the pickle names anything but numpy arrays and plain containers, or is broken.
    """
    try:
        content, _ = _plain(_plain_unpickler(raw, held).load(), {})
        return content
    except ClipError:
        raise
    except Exception as e:  # broken bytes make unpicklers and numpy's own code raise whatever they like
        raise ClipError(raw.name, found=f"a broken pickle ({e})", expected="a whole one") from e


def _plain_unpickler(raw: RawFile, held: Collection[tuple[str, str]]) -> Any:
    """joblib's unpickler with rebuilders of our own: numpy's trust the state they are given, down to a crash."""
    from joblib import numpy_pickle

    class ArrayOnly(numpy_pickle.NumpyArrayWrapper):  # type: ignore[misc]
        """joblib's array wrapper, which would unpickle object arrays."""

        def read_array(self, unpickler: Any, *args: Any, **kwargs: Any) -> ndarray:
            if self.dtype.hasobject:
                raise ClipError(raw.name, found="an array of Python objects", expected="arrays of numbers")
            if math.prod(map(int, self.shape)) * self.dtype.itemsize > MAX_UNPACKED:
                raise ClipError(raw.name, found=f"an array of shape {self.shape}", expected="a motion clip")
            return np.asarray(super().read_array(unpickler, *args, **kwargs))

    rebuilders: dict[tuple[str, str], Any] = {
        ("numpy", "ndarray"): _NDARRAY,
        ("numpy", "dtype"): _Type,
        ("collections", "OrderedDict"): OrderedDict,
        ("joblib.numpy_pickle", "NumpyArrayWrapper"): ArrayOnly,
        ("_codecs", "encode"): lambda text, _: text.encode("latin1"),  # how protocol 2 spells bytes
        **{(module, "_reconstruct"): _Array for module in _MULTIARRAY},
        **{(module, "scalar"): _scalar for module in _MULTIARRAY},
        **{(module, "_frombuffer"): _from_buffer for module in _NUMERIC},
        **dict(torch_pickle.REBUILDERS),
    }
    if held:
        python2 = {("copy_reg", "_reconstructor"): lambda kind, *_: kind(), ("__builtin__", "object"): _NDARRAY}
        rebuilders |= {name: _Held for name in held} | python2

    class Plain(numpy_pickle.NumpyUnpickler):  # type: ignore[misc]
        """Refuses every name that is not on the list before it is called."""

        def find_class(self, module: str, name: str) -> Any:
            if (module, name) in rebuilders:
                return rebuilders[module, name]
            raise ClipError(
                raw.name,
                found=f"a pickle that wants to call {module}.{name}",
                expected="numpy arrays and plain containers",
                cure="do not open it elsewhere unless you trust whoever made it",
            )

        def load_build(self) -> None:
            state, thing = self.stack.pop(), self.stack[-1]
            if isinstance(thing, ArrayOnly):
                thing.__dict__.update({k: _plain(v, {})[0] for k, v in state.items()})
                self.stack[-1] = thing.read(self, ensure_native_byte_order=True)
            elif isinstance(thing, (_Type, _Array, _Held)):
                thing.take(state)
            else:
                raise ClipError(raw.name, found=f"a state for a {type(thing).__name__}", expected="plain containers")

        dispatch: ClassVar[Any] = numpy_pickle.NumpyUnpickler.dispatch | {pickle.BUILD[0]: load_build}

    plain = Plain(str(raw.path), io.BytesIO(_unpacked(raw)), ensure_native_byte_order=True)
    if held:
        plain.encoding = "latin1"
    return plain


_NDARRAY = object()  # stands for the class, which a pickle may name but not call


class _Held:
    """An object of which only the state is wanted."""

    def __init__(self) -> None:
        self.state: Mapping[str, Any] = {}

    def take(self, state: Any) -> None:
        """The dictionary that it consists of."""
        if not isinstance(state, Mapping):
            raise ValueError("a state that is no dictionary")
        self.state = state


class _Type:
    """`numpy.dtype` of a pickle: a type code, then a state that tells the byte order."""

    def __init__(self, code: Any, *_: Any) -> None:
        self.objects = code in ("O", "O8", "|O")
        if not self.objects and not (isinstance(code, str) and _TYPE.fullmatch(code)):
            raise ValueError(f"an element type {code!r:.50}")
        self.dtype = np.dtype(code)

    def take(self, state: Any) -> None:
        """(version, byte order, no sub-array, no names, no fields, ...)."""
        order, *structure = state[1:5]
        if order not in ("<", ">", "|", "=") or any(s is not None for s in structure):
            raise ValueError("an element type with a structure")
        if not self.objects:
            self.dtype = self.dtype.newbyteorder(order)


class _Array:
    """An array of a pickle: begun empty, then given (version, shape, type, Fortran order, bytes)."""

    def __init__(self, kind: Any, shape: Any, _: Any) -> None:
        if kind is not _NDARRAY or shape != (0,):
            raise ValueError(f"an array begun with shape {shape!r:.50}")
        self.array: Any = np.zeros(0)

    def take(self, state: Any) -> None:
        """Read the elements; a list instead of bytes is an array of objects: of a single one, what numpy.save wraps."""
        _, shape, kind, fortran, data = state
        if isinstance(kind, _Type) and kind.objects:
            if shape not in ((), (1,)) or not isinstance(data, list) or len(data) != 1:
                raise ValueError("an array of Python objects")
            self.array = data[0]
            return
        data = data.encode("latin1") if isinstance(data, str) else data  # Python 2's bytes
        if not isinstance(kind, _Type) or not isinstance(data, bytes):
            raise ValueError("an array of objects")
        self.array = np.frombuffer(data, kind.dtype).reshape(shape, order="F" if fortran else "C")


def _scalar(kind: Any, data: Any) -> Any:
    """`numpy.core.multiarray.scalar`: one number."""
    if kind.objects:
        raise ValueError("a scalar of Python objects")
    return np.frombuffer(data, kind.dtype)[0]


def _from_buffer(data: Any, kind: Any, shape: Any, order: Any) -> ndarray:
    """`numpy.core.numeric._frombuffer`, protocol 5's arrays."""
    if kind.objects:
        raise ValueError("an array of Python objects")
    return np.frombuffer(data, kind.dtype).reshape(shape, order=order)


def _plain(value: Any, done: dict[int, tuple[Any, int]]) -> tuple[Any, int]:
    """The content of a pickle with its arrays in place of what took their state, and how many values it holds.

    What is named a thousand times over is looked at once, and counted a thousand times.
    """
    if id(value) in done:
        return done[id(value)]
    if isinstance(value, _Array) and not isinstance(value.array, ndarray):
        return _plain(value.array, done)
    if isinstance(value, _Held):
        return _plain(value.state, done)
    if isinstance(value, (_Array, _Type)):
        return (value.array if isinstance(value, _Array) else value.dtype), 1
    out, count = value, 1
    if isinstance(value, Mapping):
        pairs = {k: _plain(v, done) for k, v in value.items()}
        out, count = {k: v for k, (v, _) in pairs.items()}, 1 + sum(n for _, n in pairs.values())
    elif isinstance(value, (list, tuple)):
        parts = [_plain(v, done) for v in value]
        out, count = [v for v, _ in parts], 1 + sum(n for _, n in parts)
    if count > _MOST_VALUES:
        raise ValueError(f"over {_MOST_VALUES} values, most of them named again and again")
    done[id(value)] = out, count
    return out, count


def _unpacked(raw: RawFile) -> bytes:
    """The pickle stream itself, decompressed up to the size limit of any file."""
    opener = next((o for magic, o in OPENERS.items() if raw.head.startswith(magic)), None)
    if opener is None:
        return raw.data
    stream, parts, size = opener(io.BytesIO(raw.data)), list[bytes](), 0
    while part := stream.read(_PART):
        parts.append(part)
        size += len(part)
        if size > MAX_UNPACKED:
            raise ClipError(raw.name, found=f"over {MAX_UNPACKED} bytes once unpacked", expected="a motion clip")
    return b"".join(parts)
