"""Files of any tool, each judged as it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cli.shell import FileOptions, line, some
from clips import Clip, ClipError, RobotClip, cut, is_reference, load_reference, read_clip, read_of_several
from retarget import Retargeted, as_it_stands
from robot_models import load_robot

OWN_FEET = (
    "what touches is found from the robot's own feet, in every file alike: a retargeting, judged by the person's feet, has "
    "other numbers"
)


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A file and what it came to."""

    name: str  # of the file, with its folder where names repeat
    path: Path
    clip: Clip
    result: Retargeted


def judge_all(paths: Sequence[Path], options: FileOptions) -> list[Judged]:
    """Read robots' motions and judge each as it stands.

    Raises:
        ClipError: a file holds a person, or cannot be read.
    """
    some(paths, "a motion file")
    stems = [path.name for path in paths]
    names = [str(path) if stems.count(path.name) > 1 else path.name for path in paths]
    judged = []
    for name, path in zip(names, paths, strict=True):
        clip = (read_of_several if len(paths) > 1 else read_clip)(path, options.reading())
        if not isinstance(clip, RobotClip):
            raise ClipError(
                str(path), found=f"a person ({clip.source.dialect})", expected="a robot's joints",
                cure=f"retarget it first: {line('dance-retarget', path, '--robot', 'g1')}",
            )  # fmt: skip
        if is_reference(path):  # its dance: what is compared with a recording begins where that does
            reference = load_reference(path)
            dance, fps = reference.dance, reference.fps
            clip = cut(clip, dance.start / fps, (dance.stop - 1) / fps)
            assert isinstance(clip, RobotClip)
        judged.append(Judged(name=name, path=path, clip=clip, result=as_it_stands(clip, load_robot(clip.robot))))
    return judged
