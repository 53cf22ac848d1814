"""The files of a training run, and what is asked of them before anything heavy is imported."""

from __future__ import annotations

import zipfile
from pathlib import Path

from tracking.errors import TrackingError
from tracking.policy import SHIPPED

CHECKPOINT, TEACHER, CURVES, LABELS = "checkpoint.pt", "teacher.pt", "curves.csv", "labels.bin"
REHEARSAL = "rehearsal.npz"  # the dances that a tracker knows, beside it
AUTO, NOBODY = "auto", "none"


def refuse_run_that_is_there(folder: Path) -> None:
    """Refuse to begin a run where there is one.

    Raises:
        TrackingError: a run is already there.
    """
    if any((folder / name).exists() for name in (CHECKPOINT, TEACHER)):
        raise TrackingError(
            str(folder), found="a run that is already there", expected="a new folder",
            cure="name another, or go on with it", option="resume", suggestion=" ",
        )  # fmt: skip


def refuse_missing_run(folder: Path) -> None:
    """Refuse to go on with a run where there is none.

    Raises:
        TrackingError: no run is there.
    """
    if not any((folder / name).exists() for name in (CHECKPOINT, TEACHER)):
        raise TrackingError(
            str(folder), found="no run to go on with", expected=f"a folder with a {CHECKPOINT} or a {TEACHER}",
            cure="name its folder, or begin one",
        )  # fmt: skip


def named_teacher(asked: str) -> Path:
    """The file of a teacher that is asked for: by its path, its folder, or the name of one that comes with the package.

    Raises:
        TrackingError: there is no such teacher, or it is no archive as torch writes them.
    """
    own, given = SHIPPED / asked / TEACHER, Path(asked)
    if own.is_file():
        return own
    path = given / TEACHER if given.is_dir() else given
    if not path.is_file():
        shipped = sorted(p.parent.name for p in SHIPPED.glob(f"*/{TEACHER}"))
        known = ("a tracker's ONNX", "a teacher.pt", *shipped, NOBODY)
        raise TrackingError(
            f"teacher '{asked}'", found="no such file", expected=", ".join(known), option="teacher", suggestion=NOBODY
        )
    if path.suffix != ".onnx" and not zipfile.is_zipfile(path):
        raise TrackingError(
            str(path), found="a file that is no teacher", expected="a teacher.pt as a run keeps it, or a tracker's ONNX"
        )
    return path
