"""Files from outside: regular ones only, no larger than their kind is, and no deeper than a parser goes."""

from __future__ import annotations

import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from robot_models.errors import DanceError
from robot_models.incoming.limits import MAX_FILE

T = TypeVar("T")


def regular_file(path: Path, *, expected: str, most: int = MAX_FILE, error: type[DanceError] = DanceError) -> Path:
    """The path, of a regular file of at most so many bytes: a pipe would wait for ever, a device never end.

    Raises:
        DanceError: of the type given.
    """
    try:
        told = path.stat()
    except (OSError, ValueError) as e:
        found = f"no such file ({e.strerror or e})" if isinstance(e, OSError) else "a path that is none"
        raise error(str(path), found=found, expected=expected, cure="check the path") from e
    if not stat.S_ISREG(told.st_mode):
        kind = "a folder" if stat.S_ISDIR(told.st_mode) else "a pipe or a device"
        raise error(str(path), found=kind, expected=expected, cure="check the path")
    if told.st_size > most:
        raise error(str(path), found=f"{told.st_size} bytes", expected=f"{expected}, of at most {most} bytes")
    return path


def read_bytes(path: Path, *, expected: str, most: int = MAX_FILE, error: type[DanceError] = DanceError) -> bytes:
    """A regular file, whole.

    Raises:
        DanceError: of the type given; also where nobody may read it.
    """
    regular_file(path, expected=expected, most=most, error=error)
    try:
        with open(path, "rb") as stream:
            data = stream.read(most + 1)
    except OSError as e:
        raise error(str(path), found=f"a file that cannot be read ({e.strerror})", expected=expected) from e
    if len(data) > most:
        raise error(str(path), found=f"over {most} bytes", expected=expected)
    return data


def read_text(path: Path, *, expected: str, most: int, error: type[DanceError] = DanceError) -> str:
    """A regular file of text in UTF-8.

    Raises:
        DanceError: of the type given.
    """
    try:
        return read_bytes(path, expected=expected, most=most, error=error).decode()
    except UnicodeDecodeError as e:
        raise error(str(path), found="bytes that are no text in UTF-8", expected=expected) from e


def expanded(value: object) -> float:
    """How many values stand in nested lists and tables once every alias is spelt out; infinite where one holds itself."""
    sizes: dict[int, float] = {}

    def size(item: object) -> float:
        if not isinstance(item, dict | list | tuple):
            return 1.0
        if id(item) not in sizes:
            sizes[id(item)] = float("inf")  # of what is met again inside itself
            parts = (*item.keys(), *item.values()) if isinstance(item, dict) else item
            sizes[id(item)] = 1.0 + sum(map(size, parts))
        return sizes[id(item)]

    return size(value)


@contextmanager
def reading(where: str, *, expected: str, error: type[DanceError] = DanceError) -> Iterator[None]:
    """A file of somebody else's is taken apart inside: whatever its content makes Python stumble over is a refusal.

    Raises:
        DanceError: of the type given; one that is raised inside stays as it is.
    """
    try:
        yield
    except DanceError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError, MemoryError) as e:
        raise error(where, found=f"{type(e).__name__}: {e}"[:200], expected=expected) from e


def parsed(
    parse: Callable[[str], T], text: str, where: str, *, expected: str, error: type[DanceError] = DanceError
) -> T:
    """What a parser makes of a text.

    Raises:
        DanceError: of the type given, where the parser refuses it or it is nested too deep.
    """
    try:
        return parse(text)
    except RecursionError as e:
        raise error(where, found="text that is nested too deep", expected=expected) from e
    except ValueError as e:
        raise error(where, found=f"text that cannot be read ({e})", expected=expected) from e
