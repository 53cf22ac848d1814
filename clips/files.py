"""Outputs are whole or absent: written beside their place, then renamed."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from robot_models import DanceError

_NOT_WRITABLE = {
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.EISDIR, errno.EFBIG, errno.ENOTDIR, errno.ENAMETOOLONG
}  # fmt: skip


class OutputError(DanceError):
    """A file that cannot be written."""


@contextmanager
def write_whole(path: Path) -> Iterator[IO[bytes]]:
    """A stream that becomes `path` only when the block ends without an error.

    Raises:
        OutputError: the folder is absent or read-only, or the disk is full.
    """
    with aside(path) as beside, open(beside, "wb") as stream:
        yield stream


@contextmanager
def aside(path: Path) -> Iterator[Path]:
    """A free path in the same folder; what stands there when the block ends becomes `path`."""
    try:
        handle, name = tempfile.mkstemp(prefix=".part-", suffix=path.suffix, dir=path.parent or ".")
        os.close(handle)
    except OSError as e:
        raise OutputError(
            str(path),
            found=f"a folder that takes no file ({e.strerror})",
            expected="an existing folder you may write to",
        ) from e
    beside = Path(name)
    try:
        with _refused_where_full(path):
            yield beside
            beside.chmod(0o666 & ~_umask())
            os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def folder_aside(path: Path) -> Iterator[Path]:
    """An empty folder beside; when the block ends without an error it becomes `path`, which must not be there.

    Raises:
        OutputError: the folder above is absent or read-only, or the disk is full.
    """
    beside = path.with_name(f".{path.name}.part")
    shutil.rmtree(beside, ignore_errors=True)  # of a process that was killed
    try:
        with _refused_where_full(path):
            beside.mkdir(parents=True)
            yield beside
            beside.replace(path)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


@contextmanager
def _refused_where_full(path: Path) -> Iterator[None]:
    """A disk that takes nothing more is a refusal; whatever else goes wrong stays what it is."""
    try:
        yield
    except OSError as e:
        if e.errno not in _NOT_WRITABLE:
            raise  # not about this file
        raise OutputError(str(path), found=f"a write that failed ({e.strerror})", expected="a disk with room") from e


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
