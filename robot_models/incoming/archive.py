"""Arrays of an `.npz`: no pickles, nothing that unpacks to more than its header says or than any motion holds."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from robot_models.errors import DanceError
from robot_models.incoming.files import regular_file
from robot_models.incoming.limits import MAX_FILE, MAX_UNPACKED


def read_arrays(
    source: Path | bytes, where: str, *, expected: str, error: type[DanceError] = DanceError
) -> dict[str, ndarray]:
    """Every array of an archive that needs no unpickling; arrays of objects are left alone.

    Args:
        source: the file, or its bytes.
        where: its name, for messages.
        expected: what it should be, for messages.
        error: type of the refusal.

    Raises:
        DanceError: no such file, no archive, or a broken one, or one that unpacks to more than any motion holds.
    """
    stream: Any = io.BytesIO(source) if isinstance(source, bytes) else None
    if isinstance(source, Path):
        stream = regular_file(source, expected=expected, most=MAX_FILE, error=error)
    arrays: dict[str, ndarray] = {}
    try:
        with zipfile.ZipFile(stream) as archive:
            refuse_bombs(archive, where, error)
            for info in archive.infolist():
                with archive.open(info) as member:
                    array = _array(member, info.file_size)
                if array is not None:
                    arrays[info.filename.removesuffix(".npy")] = array
    except DanceError:
        raise
    except Exception as e:  # broken headers make zip's and numpy's parsers raise whatever they like
        raise error(where, found=f"a broken archive ({e})", expected=expected) from e
    return arrays


def read_array(data: bytes, where: str, *, expected: str, error: type[DanceError] = DanceError) -> ndarray | None:
    """The array of a bare `.npy`; None for one of objects, which only unpickling could open.

    Args:
        data: the file.
        where: its name, for messages.
        expected: what it should be, for messages.
        error: type of the refusal.

    Raises:
        DanceError: a broken header, or one that says more than the file holds.
    """
    try:
        return _array(io.BytesIO(data), len(data))
    except Exception as e:  # broken headers make numpy's parser raise whatever it likes
        raise error(where, found=f"a broken array ({e})", expected=expected) from e


def refuse_bombs(archive: zipfile.ZipFile, where: str, error: type[DanceError]) -> None:
    """Refuse an archive whose members say that they unpack to more than any clip holds.

    Raises:
        DanceError: of the type given.
    """
    size = sum(info.file_size for info in archive.infolist())
    if size > MAX_UNPACKED:
        raise error(
            where, found=f"an archive that unpacks to {size} bytes", expected=f"at most {MAX_UNPACKED}",
            cure="an hour of motion is less; leave out what is no motion",
        )  # fmt: skip


def _array(member: Any, size: int) -> ndarray | None:
    """One .npy member; None for an array of objects, which only unpickling could open, and for what is no array."""
    npy: Any = np.lib.format
    head = member.read(npy.MAGIC_LEN)
    if not head.startswith(b"\x93NUMPY"):
        return None
    header = npy.read_array_header_1_0 if tuple(head[6:8]) == (1, 0) else npy.read_array_header_2_0
    shape, fortran, dtype = header(member)
    if dtype.hasobject:
        return None
    needed = math.prod(shape) * dtype.itemsize
    if needed > size or any(n < 0 for n in shape):
        raise ValueError(f"an array of shape {shape} in {size} bytes")
    rest = bytearray(member.read())  # to its end, where the checksum is compared; and an array that may be written to
    flat = np.frombuffer(rest, dtype=dtype, count=math.prod(shape))
    return flat.reshape(shape, order="F" if fortran else "C")
