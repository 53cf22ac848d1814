"""Another tool's motion where a reference is asked for: taken as it stands, and said so."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from cli.judging.judge import judge_all
from cli.shell import FileOptions
from clips import is_reference, save_reference


def as_references(paths: Sequence[Path], options: FileOptions, folder: Path, console: Console) -> list[Path]:
    """The files to use: references and folders themselves; of every other file a reference that is written for it.

    Args:
        paths: references of this project, folders of them, and joint-space files of any tool.
        options: what is stated about the latter.
        folder: where references of them go.
        console: told which were taken as they stand.

    Raises:
        ClipError: a file that is neither.
    """
    return [
        path if not path.is_file() or is_reference(path) else _written(path, options, folder, console) for path in paths
    ]


@contextmanager
def reference_for(path: Path | None, options: FileOptions, console: Console) -> Iterator[Path | None]:
    """The same for one file, or none, for as long as it is needed."""
    if path is None or not path.is_file() or is_reference(path):
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        yield _written(path, options, Path(folder), console)


def _written(path: Path, options: FileOptions, folder: Path, console: Console) -> Path:
    (judged,) = judge_all([path], options)
    reference = judged.result.reference
    out = folder / f"{path.stem}_{reference.robot}_as_it_stands.npz"
    save_reference(reference, out)
    if out.parent == Path():
        console.print(f"wrote {out}")
    said = f"{judged.clip.source.dialect}, {reference.duration_s:.1f} s for {reference.robot}"
    missed = ", ".join(m.label for m in judged.result.report.failures)
    console.print(f"{path.name} as it stands: {said}{f'; gates missed: {missed}' if missed else ''}")
    return out
