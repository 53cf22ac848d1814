"""What a run began with: its teacher and its settings, which it goes on with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cli.shell import as_toml
from cli.training.arguments import Arguments
from clips import write_whole
from tracking import AUTO, NOBODY, TrackingError, TrainConfig

if TYPE_CHECKING:
    from tracking.task import Selection

_TAUGHT_BY, _BEGUN_WITH, _SETTINGS = "taught_by.txt", "begun_with.txt", "config.toml"  # in a run's folder


def _without_budget(numbers: TrainConfig) -> TrainConfig:
    plain = TrainConfig()
    distillation = replace(numbers.distillation, samples=plain.distillation.samples)
    return replace(numbers, minutes=plain.minutes, steps=plain.steps, distillation=distillation)


def who_taught(folder: Path) -> str:
    """The teacher of a run, or nobody."""
    return _told(folder / _TAUGHT_BY, NOBODY)


def _told(file: Path, otherwise: str) -> str:
    return file.read_text(encoding="utf-8").strip() if file.is_file() else otherwise


def as_begun(args: Arguments, folder: Path) -> Arguments:
    """The arguments with the teacher and the settings that the run began with, where no others are stated.

    Raises:
        TrackingError: it began with another policy than the one stated.
    """
    settings = folder / _SETTINGS
    if args.teacher == AUTO and (folder / _TAUGHT_BY).is_file():
        args = replace(args, teacher=who_taught(folder))
    begun = _told(folder / _BEGUN_WITH, "")
    if args.begin is not None and str(args.begin) != begun:
        raise TrackingError(
            f"--from {args.begin}", found=f"--resume beside it, of a run that began with {begun or 'nothing'}",
            expected="the policy that it began with, or none", cure="begin another run with it: --out ANOTHER, no --resume",
        )  # fmt: skip
    args = replace(args, begin=Path(begun) if begun else None)
    return replace(args, config=settings) if args.config is None and settings.is_file() else args


def keep_beginning(args: Arguments, folder: Path, teacher: Path | None) -> None:
    """Keep who teaches, and all settings but how long this part of the run may take: in minutes or in steps.

    Raises:
        TrackingError: the folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise TrackingError(str(folder), found=f"no folder ({e.strerror})", expected="a folder for the run") from e
    for name, text in (
        (_TAUGHT_BY, str(teacher or NOBODY)),
        (_BEGUN_WITH, str(args.begin or "")),
        (_SETTINGS, as_toml(_without_budget(args.numbers()))),
    ):
        with write_whole(folder / name) as stream:
            stream.write(text.encode())


def teacher_of(args: Arguments, chosen: Selection, together: bool) -> Path | None:
    """Who teaches, None for nobody.

    Raises:
        TrackingError: no such tracker, or it cannot teach there.
    """
    from tracking.teaching import find_teacher

    alone = not together and args.engine == "mujoco"
    if not alone and args.teacher not in (AUTO, NOBODY):
        raise TrackingError(
            "--teacher", found="several processes or a GPU", expected="one process on the processor's cores",
            cure="teaching takes minutes there", option="engine", suggestion="mujoco",
        )  # fmt: skip
    return find_teacher(args.teacher, chosen.robot.name, 1.0 / chosen.pieces[0].reference.fps) if alone else None
