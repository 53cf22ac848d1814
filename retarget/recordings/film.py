"""A film of a dancing robot, drawn by MuJoCo off the screen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy import ndarray

from clips import OutputError, aside
from retarget.recordings.off_screen import Shot, Stage
from retarget.recordings.sound import Soundtrack, add_sound, check_song, encoder
from robot_models import RobotModel
from robot_models.maths import Progress, silent

_FPS = 25.0  # as films are shown; twice as many take twice as long to draw


def write_film(
    path: Path,
    robot: RobotModel,
    shots: Iterator[Shot],
    fps: float,
    size: tuple[int, int],
    *,
    title: str = "",
    sound: Soundtrack | None = None,
    beside: float = 0.0,
    frames: int = 0,
    progress: Progress = silent,
) -> int:
    """Write an mp4; returns the number of shots.

    Args:
        path: the film; whole or absent.
        robot: who dances.
        shots: frame by frame.
        fps: of the shots.
        size: width and height in pixels, even numbers.
        title: stands in a corner, with the seconds.
        sound: to be heard under it; a light flashes on its beats.
        beside: by how much those who stand beside the robot do so in y, at most, one way or the other [m]; 0: nobody does.
        frames: how many shots there can be, for those who are told of the progress.
        progress: told after every shot.

    Raises:
        OutputError: no OpenGL or no encoder on this machine, or the file cannot be written.
    """
    if min(size) < 16 or any(s % 2 for s in size):
        raise OutputError("film", found=f"a size of {size[0]}x{size[1]}", expected="even numbers of pixels, from 16 on")
    imageio, sound = encoder(), sound or Soundtrack()
    if sound.song is not None:
        check_song(sound.song)
    stage, every, done = Stage(robot, size, shadows=False), max(1, round(fps / _FPS)), 0
    if beside:
        stage.look_beside(np.array([0.0, 0.5 * beside]), abs(beside))
    with aside(path) as unfinished:
        film = imageio.write_frames(
            str(unfinished), size, fps=fps / every, codec="libx264", quality=7, macro_block_size=2
        )
        film.send(None)
        for done, shot in enumerate(shots, start=1):
            if (done - 1) % every == 0:
                now = (done - 1) / fps
                picture = _titled(stage.draw(shot), f"{title}  {now:.1f} s".strip(), sound.light(now))
                film.send(np.ascontiguousarray(picture))
            progress("film", done, frames)
        film.close()
        stage.close()
        if sound.song is not None:
            add_sound(unfinished, sound.song, sound.at_s)
    return done


def _titled(picture: ndarray, text: str, flash: float = 0.0) -> ndarray:
    """The picture with a line of text in its lower left corner, and the light of the beat in the lower right one."""
    from PIL import Image, ImageDraw, ImageFont  # comes with Rerun

    image, size = Image.fromarray(picture), max(12, picture.shape[0] // 36)
    place = size, picture.shape[0] - 2 * size
    font = ImageFont.load_default(size)
    draw = ImageDraw.Draw(image)
    draw.text(place, text, fill=(255, 255, 255), font=font, stroke_width=1, stroke_fill=(0, 0, 0))
    if flash > 0.0:
        middle, radius = (image.width - 2 * size, place[1] + size // 2), size * (0.4 + 0.4 * flash)
        draw.circle(middle, radius, fill=(255, 200, 60), outline=(0, 0, 0))
    return np.asarray(image)
