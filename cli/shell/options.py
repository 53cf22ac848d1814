"""Options that several commands share."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from clips import ClipError, OutputError, ReadOptions


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """What you state about the clip; a statement beats every guess."""

    fps: float | None = None
    """Frame rate of the file, where it does not say."""
    unit: str | None = None
    """Unit of its positions: m, cm, mm, inch, cmu, or a number of metres."""
    up: str | None = None
    """Its up axis: x, y, z, -x, -y or -z."""
    stature: float | None = None
    """Height of the person in metres; settles the scale of a file in unknown units."""
    quat_order: str | None = None
    """Order of its root quaternions: wxyz or xyzw."""
    joint_order: str | None = None
    """Order of its joint columns, where they have no names: mujoco (depth-first) or isaac (breadth-first)."""
    source_robot: str | None = None
    """The robot that a joint-space file was made for."""
    skeleton: str | None = None
    """The ASF that an AMC was recorded on, where it does not lie beside it."""
    mapping: str | None = None
    """A file that says which point is which part of the body, for skeletons that no custom tells apart."""
    layout: str | None = None
    """The order of points without names: smpl22, h36m17, coco17 and others, or a .txt with one name a line."""
    body_model: str | None = None
    """Your own SMPL, SMPL-H or SMPL-X model (.npz or .pkl): the bones get the lengths of the file's betas."""
    person: str | None = None
    """Of several people or clips in one file: a name (of the root, of the clip), or a number; FILE#2 says the same."""
    level: bool = True
    """Turn a world that leans, as a camera's does, upright."""
    travel: str | None = None
    """from-feet: make its way over the floor anew, so that the feet which stand stay where they are."""
    travel_scale: float | None = None
    """Factor of its root's positions, where they stand in another unit than the rest: 100, 2.54, 0.01."""
    strict: bool = False
    """Refuse a clip that needs any repair."""

    def words(self) -> tuple[str, ...]:
        """What was stated, as it is typed."""
        words = list[str]()
        for name, value in vars(self).items():
            if value == getattr(FileOptions, name):
                continue
            flag = name.replace("_", "-")
            words += [f"--no-{flag}"] if value is False else [f"--{flag}"]
            if not isinstance(value, bool):
                words.append(f"{value:g}" if isinstance(value, float) else str(value))
        return tuple(words)

    def reading(self) -> ReadOptions:
        """The same for the readers."""
        return ReadOptions(
            fps=self.fps,
            unit=self.unit,
            up=self.up,
            stature=self.stature,
            quat_order=self.quat_order,
            joint_order=self.joint_order,
            source_robot=self.source_robot,
            skeleton=self.skeleton,
            mapping=self.mapping,
            layout=self.layout,
            body_model=self.body_model,
            person=self.person,
            level=None if self.level else False,
            travel=self.travel,
            travel_scale=self.travel_scale,
        )


def some(files: Sequence[Path], what: str) -> None:
    """Refuse a command without any file.

    Raises:
        ClipError: there is none.
    """
    if not files:
        raise ClipError("the command", found="no file named", expected=what, cure="--help has examples")


def recording_name(path: Path | None) -> None:
    """Refuse a recording of another name than Rerun's.

    Raises:
        OutputError: it does not end in .rrd.
    """
    if path is not None and path.suffix != ".rrd":
        raise OutputError(f"--recording {path}", found="that name", expected="a file that ends in .rrd")


def make_folder(path: Path) -> None:
    """Make the folder of a file that was asked for; one that cannot be made is refused where the file is written."""
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)


ClipPath = Annotated[Path, tyro.conf.Positional]
Out = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]
