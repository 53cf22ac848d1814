"""Makes files that nobody should open: `python tests/clips/readers/hostile.py FOLDER`. The tests make them for themselves."""

from __future__ import annotations

import bz2
import io
import lzma
import pickle
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

GIB = 1 << 30


class _Calls:
    """Pickles into a call of `function`."""

    def __init__(self, function: Callable[..., object], *args: object) -> None:
        self._call = (function, args)

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return self._call


def _call(module: str, name: str, *args: bytes) -> bytes:
    """A pickle that calls module.name with text arguments; nothing of it needs to be importable here."""
    words = b"".join(b"X" + struct.pack("<I", len(a)) + a for a in args)
    return b"\x80\x02c" + f"{module}\n{name}\n".encode() + b"(" + words + b"tR."


def _packed_zeros(packer: Any, size: int) -> bytes:
    """A stream that unpacks to `size` zeros, made without holding them."""
    block = bytes(1 << 20)
    return b"".join([packer.compress(block) for _ in range(size >> 20)] + [packer.flush()])


def _npz(members: dict[str, bytes], level: int = zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", level) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return out.getvalue()


def _npy(shape: str, dtype: str = "<f8", data: bytes = b"\0" * 64) -> bytes:
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


def _whole(array: np.ndarray) -> bytes:
    out = io.BytesIO()
    np.lib.format.write_array(out, array, allow_pickle=True)
    return out.getvalue()


def _nested(depth: int) -> bytes:
    """{"fps": [[[ ... ]]], ...}: deeper than any recursion goes."""
    deep = b"]" * (depth + 1) + b"a" * depth
    keys = b"".join(b"X" + struct.pack("<I", len(k)) + k + b"]" for k in (b"root_pos", b"root_rot", b"dof_pos"))
    return b"\x80\x02}(" + b"X\x03\0\0\0fps" + deep + keys + b"u."


def _absurd_reconstruct() -> bytes:
    """numpy's array rebuilder asked for 8 TiB."""
    return (
        b"\x80\x02cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\n"
        b"\x8a\x06" + (1 << 40).to_bytes(6, "little") + b"\x85X\x01\0\0\0d\x87R."
    )


def _dtype_state() -> bytes:
    """A state that numpy's own dtype takes at its word, and dies of (found by fuzzing)."""
    typed = b"\x80\x02cnumpy\ndtype\nX\x02\0\0\0f8\x89\x88\x87R"
    return typed + b"(K\x03X\x01\0\0\0<K\x07}N" + b"J\xff\xff\xff\xff" * 2 + b"K\0tb."


def _laughs() -> bytes:
    """[x, x] of [x, x] of ... thirty times over: 2^30 numbers in a hundred bytes."""
    return b"\x80\x02}(X\x03\0\0\0fpsK\x1eX\x06\0\0\0frames" + _stacked(30) + b"u."


def _stacked(depth: int) -> bytes:
    """Lists of the list before, left on the stack as one value."""
    out = b"]q\x00K\x01a"
    for k in range(depth):
        out += b"0]q" + bytes([k + 1]) + b"(h" + bytes([k]) + b"h" + bytes([k]) + b"e"
    return out


def files() -> dict[str, bytes]:
    """Name -> content."""
    packed = {"poses.npy": _npy("(1000000, 72)", data=bytes(1 << 26)), "trans.npy": _npy("(2, 3)")}
    many = _npz({f"{i}.npy": _npy("(8388600,)", data=bytes(1 << 26)) for i in range(9)})
    objects = np.array([_Calls(print, "opened")], dtype=object)
    entity = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
    )
    one = b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n"
    frames = b"Frames: 90000\nFrame Time: 0.1\n" + b"1\n" * 90_000
    return {
        "calls_system.pkl": _call("os", "system", b"touch /tmp/dance-was-here"),
        "calls_eval.pkl": _call("builtins", "eval", b"1/0"),
        "calls_import.pkl": _call("importlib", "import_module", b"this"),
        "calls_load.pkl": _call("numpy", "load", b"/etc/passwd"),
        "calls_joblib.pkl": _call("joblib", "load", b"/etc/passwd"),
        "calls_dotted.pkl": b"\x80\x04\x8c\x05numpy\x8c\x0ctesting.main\x93)R.",
        "extension.pkl": b"\x80\x02\x82\x01.",
        "persistent.pkl": b"\x80\x02X\x01\0\0\0aQ.",
        "reconstruct.pkl": _absurd_reconstruct(),
        "objects_inside.pkl": pickle.dumps({"fps": 30, "root_pos": objects, "root_rot": objects, "dof_pos": objects}),
        "typed_state.pkl": _dtype_state(),
        "laughs.pkl": _laughs(),
        "nested.pkl": _nested(200_000),
        "itself.pkl": b"\x80\x02}q\x00X\x06\0\0\0framesh\x00s.",
        "long_integer.pkl": b"\x80\x02\x8b" + struct.pack("<i", 0x7FFFFFFF) + b"\x01.",
        "long_text.pkl": b"\x80\x04\x8d" + struct.pack("<Q", 1 << 60) + b"a.",
        "long_frame.pkl": b"\x80\x04\x95" + struct.pack("<Q", 1 << 60) + b"N.",
        "memo.pkl": b"\x80\x02Nr" + struct.pack("<I", 0xFFFFFFF0) + b".",
        "bomb.zlib.pkl": _packed_zeros(zlib.compressobj(9), GIB),
        "bomb.gz.pkl": _packed_zeros(zlib.compressobj(9, wbits=31), GIB),
        "bomb.bz2.pkl": _packed_zeros(bz2.BZ2Compressor(), GIB),
        "bomb.xz.pkl": _packed_zeros(lzma.LZMACompressor(preset=0), GIB),
        "bomb.npz": many,
        "bomb_one.npz": _npz(packed),
        "absurd_shape.npz": _npz({"poses.npy": _npy("(1099511627776, 72)"), "trans.npy": _npy("(1099511627776, 3)")}),
        "negative_shape.npz": _npz({"poses.npy": _npy("(-1, 72)"), "trans.npy": _npy("(-1, 3)")}),
        "wide_item.npz": _npz({"poses.npy": _npy("(1, 72)", "<V1000000000"), "trans.npy": _npy("(1, 3)")}),
        "objects.npz": _npz({"poses.npy": _whole(objects), "trans.npy": _whole(objects)}),
        "code_in_header.npz": _npz({"poses.npy": _npy("__import__('os').getpid()"), "trans.npy": _npy("(1, 3)")}),
        "long_header.npz": _npz({"poses.npy": _npy("(" + "1," * 30_000 + ")")}),
        "upwards.npz": _npz({"../../../../tmp/dance-was-here.npy": _npy("(1, 3)"), "/etc/x.npy": _npy("(1, 3)")}),
        "twice.npz": _npz({"poses.npy": _npy("(1, 72)")}) + _npz({"trans.npy": _npy("(1, 3)")}),
        "deep.bvh": (
            "HIERARCHY\nROOT a\n{\n" + "JOINT b\n{\nOFFSET 0 1 0\n" * 20_000 + "}" * 20_001 + "MOTION"
        ).encode(),
        "no_end.bvh": b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 999999999 Xposition",
        "frames.bvh": one + b"}\nMOTION\nFrames: 999999999999\nFrame Time: 0.1\n1\n",
        "ends.bvh": one + b"JOINT b\n{\nOFFSET 0 1 0\n}\n" * 900 + b"}\nMOTION\n" + frames,
        "wide.csv": b"# fps: 30\n" + b",".join([b"1"] * 200_000) + b"\n" + b",".join([b"1"] * 200_000) + b"\n",
        "quote.csv": b'# fps: 30\na_x,"b\n' + b"1,2\n" * 1000,
        "long_line.csv": b"# fps: 30\n" + b"1" * 5_000_000 + b",2\n1,2\n",
        "deep.txt": b'{"Frames": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
        "wide_number.txt": b'{"Frames": [[' + b"9" * 100_000 + b"]]}",
        "short.c3d": b"\x02\x50" + bytes(600),
        "huge.c3d": b"\x02\x50" + struct.pack("<HHHHHfHH", 0xFFFF, 0xFFFF, 1, 0xFFFF, 0, -1.0, 3, 1) + bytes(2000),
        "amc_of_nothing.amc": b":FULLY-SPECIFIED\n:DEGREES\n1\n" + b"root 0 0 0 0 0 0\n" * 10,
        "entities.urdf": (entity + "]><robot name='r'><link name='&j;'/></robot>").encode(),
        "outside.urdf": b"<!DOCTYPE r [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><robot name='r'><link name='&x;'/></robot>",
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files().items():
        (folder / name).write_bytes(data)
