"""Which clip is meant of several in one file: `FILE#2`, `FILE#NAME`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clips.errors import ClipError, SeveralClipsError
from clips.provenance import RawFile, ReadOptions
from robot_models.incoming import file_name

_TOLD = 8  # names in a refusal


def file_and_name(path: Path) -> tuple[Path, str]:
    """The file, and which of its clips or people is meant; "" where a path says nothing of that."""
    file, _, asked = str(path).partition("#")
    return (Path(file), asked) if asked and not path.exists() and Path(file).is_file() else (path, "")


def clip_stem(path: Path) -> str:
    """What files that are made of a clip are called after."""
    file, asked = file_and_name(path)
    return f"{file.stem}_{file_name(asked)}" if asked else file.stem


def one_of_several(names: Sequence[str], raw: RawFile, options: ReadOptions) -> int:
    """Place of the clip that is asked for by name, or by its number from 1 on.

    Raises:
        ClipError: nobody asked for one, or for one that is not there.
    """
    asked = options.person
    if asked is not None and asked in names:
        return list(names).index(asked)
    if asked is not None and asked.isdigit() and 1 <= int(asked) <= len(names):
        return int(asked) - 1
    more = f", and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
    listed = ", ".join(names[:_TOLD]) + more
    if asked is not None:
        found = f"no clip '{asked}' among {len(names)} ({listed})"
        raise ClipError(raw.name, found=found, expected="one clip", cure="say which, by name or by number, as FILE#1")
    raise SeveralClipsError(
        raw.name, tuple(names), found=f"{len(names)} clips ({listed})", expected="one clip",
        cure="say which, by name or by number, as FILE#1; FILE#* is all of them", option="person", suggestion="1",
    )  # fmt: skip


def refuse_another(raw: RawFile, options: ReadOptions) -> None:
    """Refuse to be asked for another than the first person or clip of a file that holds one.

    Raises:
        ClipError: somebody asked.
    """
    if options.person not in (None, "1"):
        raise ClipError(
            raw.name, found=f"person '{options.person}' asked for", expected="1: this file holds one person, or one clip",
            cure="ask for none",
        )  # fmt: skip
