"""One run per folder: a lock that the system lets go of when its process ends, however it ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tracking.errors import TrackingError

LOCK = ".lock"


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a run's folder for as long as the block lasts.

    Raises:
        TrackingError: another run writes there.
    """
    with open(folder / LOCK, "a+b") as stream:
        if not _taken(stream.fileno()):
            raise TrackingError(
                str(folder), found="another run that writes there now", expected="a folder of its own",
                cure="wait for its end, or name another",
            )  # fmt: skip
        yield


def _taken(number: int) -> bool:
    try:
        import fcntl
    except ImportError:  # Windows
        return _taken_on_windows(number)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _taken_on_windows(number: int) -> bool:
    import msvcrt

    try:
        msvcrt.locking(number, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
    except OSError:
        return False
    return True
