"""A page that waits for a recording: dropped on it, recognised, solved; what is doubtful is asked for."""

from __future__ import annotations

import shlex
import threading
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from cli.shell import FileOptions, parse
from cli.viewing.mending import Mending
from cli.viewing.mending_panel import MendingPanel
from clips import OutputError, write_whole
from retarget.stage import Figure, Page, Show, inset
from robot_models import DanceError, forward_kinematics, installed, load_robot, robot_names

_LARGEST = 200_000_000  # bytes of a recording


class UploadPanel:
    """What there is before there is a dance."""

    def __init__(self, robot: str, options: FileOptions, tracker: str) -> None:
        """Wait.

        Args:
            robot: that a recording is brought to, until another is chosen.
            options: what is stated about every recording.
            tracker: as for `MendingPanel`.
        """
        self._robot, self._options, self._tracker = robot, options, tracker
        self._clip: Path | None = None
        self._busy = threading.Lock()
        self.page: Page | None = None
        self.ahead = None

    @property
    def show(self) -> Show:
        """The robot, standing."""
        robot = load_robot(self._robot)
        pos, quat = forward_kinematics(robot, np.tile(robot.default_qpos, (2, 1)))
        return Show(
            title="drop a recording here",
            verdict="BVH, CSV, PKL, NPZ, C3D, AMC with its ASF; it stays on this machine",
            fps=50.0,
            figures=(Figure(name=robot.name, robot=robot, body_pos_w=pos, body_quat_w=quat),),
        )

    def build(self, gui: Any) -> None:
        """Add the controls."""
        with gui.add_folder("a recording"):
            files = gui.add_upload_button("drop a file on this button, or choose one", color="green")
            robots = [name for name in robot_names() if installed(name)]
            self._who = gui.add_dropdown(
                "robot", robots, initial_value=self._robot if self._robot in robots else robots[0]
            )
            self._stated = gui.add_text(
                "what you state about it", shlex.join(self._options.words()), hint="as --fps 30 --up y"
            )
            gui.add_button("try again").on_click(lambda _: self._begin())
            self._news = gui.add_html("")
            files.on_upload(lambda event: self._came(event.target.value.name, event.target.value.content))

    def _came(self, name: str, content: bytes) -> None:
        """Keep what was dropped in the current folder, where the command will find it."""
        try:
            self._clip = kept(Path(Path(name).name), content)
        except DanceError as e:
            self._refuse(e)
            return
        self._begin()

    def _begin(self) -> None:
        """Read it and bring it to the robot."""
        if self._clip is None or not self._busy.acquire(blocking=False):
            return
        try:
            options = parse(FileOptions, shlex.split(self._stated.value), "dance-view")
            mending = Mending(self._clip, self._who.value, options, self._tell)
            if self.page is not None:
                self.page.present(MendingPanel(mending, self._tracker))
        except (DanceError, ValueError) as e:
            self._refuse(e)
        except SystemExit:
            self._refuse("what is stated is not understood: as --fps 30 --up y")
        finally:
            self._busy.release()

    def _refuse(self, why: object) -> None:
        cure = getattr(why, "option", None)
        hint = f"<br>state it above: --{cure.replace('_', '-')} …" if cure else ""
        self._news.content = inset(f'<span style="color:rgb(230,55,45)">refused: {escape(str(why))}{hint}</span>')

    def _tell(self, stage: str, done: int, total: int, note: str = "") -> None:
        self._news.content = inset(f"{escape(stage)}: {done} of {total} {escape(note)}")


def kept(path: Path, content: bytes) -> Path:
    """A file of that name and content in the current folder.

    Raises:
        OutputError: another one of that name is there, or it is too large.
    """
    if len(content) > _LARGEST:
        raise OutputError(str(path), found=f"{len(content) / 1e6:.0f} MB", expected=f"at most {_LARGEST / 1e6:.0f}")
    if path.exists() and path.read_bytes() != content:
        raise OutputError(str(path), found="another file of that name in this folder", expected="a name of its own")
    if not path.exists():
        with write_whole(path) as stream:
            stream.write(content)
    return path
