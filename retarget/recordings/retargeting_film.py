"""A film of a retargeting: the person and the robot side by side, the song under it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from clips import HumanClip, Reference
from clips.music import music_of
from retarget.recordings.film import write_film
from retarget.recordings.off_screen import Shot
from retarget.recordings.person import bones_of, shift_to
from retarget.recordings.sound import Soundtrack
from robot_models import RobotModel
from robot_models.maths import Progress, silent

_SIZE = 960, 720  # [pixels]
_APART = -1.1  # from the robot to the person, in y [m]


def save_film(
    path: Path, robot: RobotModel, reference: Reference, sources: Sequence[HumanClip], *, progress: Progress = silent
) -> None:
    """Write an mp4.

    Args:
        path: the film.
        robot: the robot.
        reference: what it does.
        sources: what was recorded, one for each dance of the reference.
        progress: told after every frame.

    Raises:
        OutputError: as for `write_film`.
    """
    music = music_of(reference)
    write_film(
        path, robot, _shots(reference, sources), reference.fps, _SIZE,
        title=f"{sources[0].source.file} on {robot.name}", sound=None if music is None else Soundtrack.of(music, path.parent),
        beside=_APART, frames=reference.frames, progress=progress,
    )  # fmt: skip


def _shots(reference: Reference, sources: Sequence[HumanClip]) -> Iterator[Shot]:
    """Frame by frame; in leads and bridges the person waits in its next first pose, or its last one."""
    dances = reference.dances
    starts = np.array([dance.start for dance in dances])
    shifts = [
        shift_to(source, 0, reference.qpos[dance.start, :2] + np.array([0.0, _APART]))
        for source, dance in zip(sources, dances, strict=True)
    ]
    for t, qpos in enumerate(reference.qpos):
        k = max(0, int(np.searchsorted(starts, t, side="right")) - 1)
        frame = int(np.clip(t - dances[k].start, 0, sources[k].frames - 1))
        heel_or_toe = reference.contact[t].reshape(2, 2).any(axis=1)
        yield Shot(
            qpos=qpos,
            bones=bones_of(sources[k], frame, shifts[k]),
            touches=(bool(heel_or_toe[0]), bool(heel_or_toe[1])),
        )
