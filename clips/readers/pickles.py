"""Pickles of the field (GMR, PHC / ASAP / PBHC through joblib, MimicKit, AIST++), opened without running a stranger's code.

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
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from clips.clip import Clip, HumanClip, RobotClip
from clips.errors import ClipError
from clips.identify import choose_layout, joint_order, robot_clip
from clips.provenance import MAX_UNPACKED, Finding, RawFile, ReadOptions
from clips.readers import smpl
from robot_models.maths import rotation as rot

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


_OPENERS: dict[bytes, Callable[[io.BytesIO], Any]] = {
    b"\x1f\x8b": lambda f: gzip.GzipFile(fileobj=f),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ": lzma.LZMAFile,
    b"\x5d\x00": lzma.LZMAFile,
    # The second byte tells zlib from a text that begins with an x.
    **dict.fromkeys((b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda"), _Zlib),
}
_ABSURD = 1e6  # no position, angle or quaternion of anybody


def recognises(raw: RawFile) -> bool:
    """A pickle of protocol 2 or later, bare or compressed by joblib."""
    return (raw.head[:1] == b"\x80" and raw.head[1:2] in b"\x02\x03\x04\x05") or raw.head.startswith(tuple(_OPENERS))


def read(raw: RawFile, options: ReadOptions) -> Clip:
    """Read a pickle by the keys it holds.

    Raises:
        ClipError: it asks for code, or holds none of the known layouts.
    """
    content = load(raw)
    if isinstance(content, Mapping) and len(content) == 1 and isinstance(next(iter(content.values())), Mapping):
        return _phc(raw, next(iter(content.values())), options)
    if isinstance(content, Mapping) and {"root_pos", "root_rot", "dof_pos"} <= set(content):
        return _gmr(raw, content, options)
    if isinstance(content, Mapping) and {"smpl_poses", "smpl_trans"} <= set(content):
        return _aist(raw, content, options)
    if isinstance(content, Mapping) and "frames" in content:
        return _mimickit(raw, content, options)
    if isinstance(content, Mapping) and "root_trans_offset" in content:
        return _phc(raw, content, options)
    if isinstance(content, Mapping) and len(content) > 1 and all(isinstance(v, Mapping) for v in content.values()):
        raise ClipError(
            raw.name, found=f"{len(content)} clips ({', '.join(map(str, list(content)[:4]))} ...)", expected="one clip",
            cure="save the clip you want alone",
        )  # fmt: skip
    keys = ", ".join(map(str, content)) if isinstance(content, Mapping) else type(content).__name__
    raise ClipError(
        raw.name,
        found=f"a pickle with {keys}",
        expected="GMR (root_pos, root_rot, dof_pos), PHC/ASAP/PBHC (root_trans_offset, dof), MimicKit (frames) or AIST++ "
        "(smpl_poses, smpl_trans)",
    )


def load(raw: RawFile) -> Any:
    """Unpickle plain data; joblib's compressed and array-appending form too.

    Raises:
        ClipError: the pickle names anything but numpy arrays and plain containers, or is broken.
    """
    try:
        content, _ = _plain(_plain_unpickler(raw).load(), {})
        return content
    except ClipError:
        raise
    except Exception as e:  # broken bytes make unpicklers and numpy's own code raise whatever they like
        raise ClipError(raw.name, found=f"a broken pickle ({e})", expected="a whole one") from e


def _plain_unpickler(raw: RawFile) -> Any:
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
    }

    class Plain(numpy_pickle.NumpyUnpickler):  # type: ignore[misc]
        """Refuses every name that is not on the list before it is called."""

        def find_class(self, module: str, name: str) -> Any:
            if (module, name) in rebuilders:
                return rebuilders[module, name]
            raise ClipError(
                raw.name, found=f"a pickle that wants to call {module}.{name}",
                expected="numpy arrays and plain containers",
                cure="do not open it elsewhere unless you trust whoever made it",
            )  # fmt: skip

        def load_build(self) -> None:
            state, thing = self.stack.pop(), self.stack[-1]
            if isinstance(thing, ArrayOnly):
                thing.__dict__.update({k: _plain(v, {})[0] for k, v in state.items()})
                self.stack[-1] = thing.read(self, ensure_native_byte_order=True)
            elif isinstance(thing, (_Type, _Array)):
                thing.take(state)
            else:
                raise ClipError(raw.name, found=f"a state for a {type(thing).__name__}", expected="plain containers")

        dispatch: ClassVar[Any] = numpy_pickle.NumpyUnpickler.dispatch | {pickle.BUILD[0]: load_build}

    return Plain(str(raw.path), io.BytesIO(_unpacked(raw)), ensure_native_byte_order=True)


_NDARRAY = object()  # stands for the class, which a pickle may name but not call


class _Type:
    """`numpy.dtype` of a pickle: a type code, then a state that tells the byte order."""

    def __init__(self, code: Any, *_: Any) -> None:
        if not (isinstance(code, str) and _TYPE.fullmatch(code)):
            what = "Python objects" if isinstance(code, str) and code.startswith("O") else "an element type"
            raise ValueError(f"{what} {code!r:.50}")
        self.dtype = np.dtype(code)

    def take(self, state: Any) -> None:
        """(version, byte order, no sub-array, no names, no fields, ...)."""
        order, *structure = state[1:5]
        if order not in ("<", ">", "|", "=") or any(s is not None for s in structure):
            raise ValueError("an element type with a structure")
        self.dtype = self.dtype.newbyteorder(order)


class _Array:
    """An array of a pickle: begun empty, then given (version, shape, type, Fortran order, bytes)."""

    def __init__(self, kind: Any, shape: Any, _: Any) -> None:
        if kind is not _NDARRAY or shape != (0,):
            raise ValueError(f"an array begun with shape {shape!r:.50}")
        self.array = np.zeros(0)

    def take(self, state: Any) -> None:
        """Read the elements; a list instead of bytes is an array of objects."""
        _, shape, kind, fortran, data = state
        if not isinstance(kind, _Type) or not isinstance(data, bytes):
            raise ValueError("an array of objects")
        self.array = np.frombuffer(data, kind.dtype).reshape(shape, order="F" if fortran else "C")


def _scalar(kind: Any, data: Any) -> Any:
    """`numpy.core.multiarray.scalar`: one number."""
    return np.frombuffer(data, kind.dtype)[0]


def _from_buffer(data: Any, kind: Any, shape: Any, order: Any) -> ndarray:
    """`numpy.core.numeric._frombuffer`, protocol 5's arrays."""
    return np.frombuffer(data, kind.dtype).reshape(shape, order=order)


def _plain(value: Any, done: dict[int, tuple[Any, int]]) -> tuple[Any, int]:
    """The content of a pickle with its arrays in place of what took their state, and how many values it holds.

    What is named a thousand times over is looked at once, and counted a thousand times.
    """
    if id(value) in done:
        return done[id(value)]
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
    opener = next((o for magic, o in _OPENERS.items() if raw.head.startswith(magic)), None)
    if opener is None:
        return raw.data
    stream, parts, size = opener(io.BytesIO(raw.data)), list[bytes](), 0
    while part := stream.read(_PART):
        parts.append(part)
        size += len(part)
        if size > MAX_UNPACKED:
            raise ClipError(raw.name, found=f"over {MAX_UNPACKED} bytes once unpacked", expected="a motion clip")
    return b"".join(parts)


def _gmr(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> RobotClip:
    return _joint_space(
        raw,
        "GMR pickle",
        content.get("fps"),
        content["root_pos"],
        content["root_rot"],
        "xyzw",
        content["dof_pos"],
        options,
    )


def _phc(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> RobotClip:
    missing = {"root_trans_offset", "root_rot", "dof"} - set(content)
    if missing:
        raise ClipError(
            raw.name,
            found=f"no {', '.join(sorted(missing))} among {', '.join(content)}",
            expected="a PHC/ASAP/PBHC clip",
        )
    return _joint_space(
        raw, "PHC/ASAP/PBHC pickle", content.get("fps"), content["root_trans_offset"], content["root_rot"], "xyzw",
        content["dof"], options,
    )  # fmt: skip


def _mimickit(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> RobotClip:
    frames = _numbers(raw, "frames", content["frames"])
    if frames.shape[1] < 7:
        raise ClipError(f"{raw.name}, frames", found=f"{frames.shape[1]} columns", expected="3 + 3 + joints")
    quat = rot.exp(frames[:, 3:6])
    return _joint_space(
        raw, "MimicKit pickle", content.get("fps"), frames[:, :3], quat, "wxyz", frames[:, 6:], options,
        conversions=["root rotation vector -> quaternion"],
    )  # fmt: skip


def _aist(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> HumanClip:
    """AIST++: SMPL poses, translation in units of `smpl_scaling`, no rate."""
    if options.fps is None:
        raise ClipError(
            raw.name, found="no frame rate: AIST++ files have none", expected="a stated one: AIST++ is at 60, EDGE's outputs at 30",
            cure="state it", option="fps", suggestion="60",
        )  # fmt: skip
    poses, trans = (_numbers(raw, key, content[key]) for key in ("smpl_poses", "smpl_trans"))
    scaling = np.asarray(content.get("smpl_scaling", 1.0), dtype=float).reshape(-1)
    if scaling.size != 1 or not scaling[0] > 0.0:
        raise ClipError(
            f"{raw.name}, smpl_scaling", found=_told(content["smpl_scaling"]), expected="one number above 0"
        )
    return smpl.read(raw, {"poses": poses, "trans": trans / scaling[0]}, options)


def _joint_space(
    raw: RawFile, dialect: str, fps: Any, pos: Any, quat: Any, order: str, dof: Any, options: ReadOptions,
    conversions: Sequence[str] = (),
) -> RobotClip:  # fmt: skip
    if fps is None and options.fps is None:
        raise raw.no_fps()
    try:
        rate = float(options.fps if options.fps is not None else np.asarray(fps, dtype=float).reshape(-1)[0])
    except (TypeError, ValueError, IndexError) as e:
        raise ClipError(f"{raw.name}, fps", found=_told(fps), expected="frames per second", option="fps") from e
    why = "given" if options.fps is not None else "key 'fps'"
    joints = _numbers(raw, "joint angles", dof)
    root_pos, root_quat = _numbers(raw, "root position", pos), _numbers(raw, "root rotation", quat)
    _check_root(raw, root_pos, root_quat, joints)
    robot, names, finding = choose_layout(raw, joints.shape[1], options)
    names, column_order = joint_order(raw, robot, names, root_pos, root_quat, joints, options)
    return robot_clip(
        raw,
        dialect=dialect,
        fps=rate,
        robot=robot,
        joint_names=names,
        root_pos=root_pos,
        root_quat=root_quat,
        quat_order=order,
        joint_pos=joints,
        options=options,
        findings=[
            Finding(what="fps", value=f"{rate:.6g}", why=why, confidence="stated", option="fps"),
            finding,
            column_order,
        ],
        conversions=conversions,
    )


def _check_root(raw: RawFile, pos: ndarray, quat: ndarray, joints: ndarray) -> None:
    if pos.shape[1:] != (3,) or quat.shape[1:] != (4,) or not len(pos) == len(quat) == len(joints):
        raise ClipError(
            raw.name, found=f"root positions {pos.shape}, rotations {quat.shape} and joints {joints.shape}",
            expected="frames by 3, 4 and joints",
        )  # fmt: skip


def _numbers(raw: RawFile, what: str, value: Any) -> ndarray:
    try:
        with np.errstate(all="ignore"):  # a signalling NaN in float32
            array = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as e:
        raise ClipError(f"{raw.name}, {what}", found=f"no numbers ({e})", expected="a table of numbers") from e
    if array.ndim == 3 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim != 2:
        raise ClipError(f"{raw.name}, {what}", found=f"an array of shape {array.shape}", expected="frames by columns")
    if not (np.abs(array) < _ABSURD).all():
        raise ClipError(
            f"{raw.name}, {what}", found="numbers that are not finite, or absurd", expected="metres and radians"
        )
    return array


def _told(value: Any) -> str:
    """A stranger's value in a message; nested too deep, it has no text."""
    try:
        return f"{value!r:.80}"
    except RecursionError:
        return f"a {type(value).__name__} nested without end"
