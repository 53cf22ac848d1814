"""The controls of a policy that dances while one looks on: pushes, a slippery floor, a heavier robot, late motors."""

from __future__ import annotations

import tempfile
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clips import save_reference
from retarget import Retargeted
from retarget.stage import Figure, Page, Panel, Show, inset
from robot_models import forward_kinematics

if TYPE_CHECKING:
    from tracking.evaluation import Hindrance, LiveDance

NOBODY, AUTO = "none", "auto"
_PUSHES = {"◀": (0.0, 1.0), "▲": (1.0, 0.0), "▼": (-1.0, 0.0), "▶": (0.0, -1.0)}  # forward, left
_AFTER_S = 1.0  # a fall is looked at for so long


class LivePanel:
    """A live dance on a page: what was danced stays on the time line, and the next frame is simulated as it is shown."""

    def __init__(self, dance: LiveDance, name: str, back: Panel | None = None) -> None:
        """Begin with the reference where nothing is danced yet; `back` gets the page when one has seen enough."""
        self._dance, self._name, self._before = dance, name, back
        reference = dance.reference
        self._pos, self._quat = (np.array(a) for a in (reference.body_pos_w, reference.body_quat_w))
        self._waits = 0
        self.page: Page | None = None
        self._busy = threading.Lock()  # clicks come from other threads

    @property
    def show(self) -> Show:
        """The robot, and pale where it should be."""
        dance, reference = self._dance, self._dance.reference
        return Show(
            title=f"{self._name} on {dance.robot.name}, in the simulator",
            verdict="dancing as you look: push it",
            fps=reference.fps,
            figures=(
                Figure(robot=dance.robot, name=self._name, body_pos_w=self._pos, body_quat_w=self._quat),
                Figure(
                    robot=dance.robot, name="its reference", ghost=True,
                    body_pos_w=reference.body_pos_w, body_quat_w=reference.body_quat_w,
                ),
            ),
        )  # fmt: skip

    def build(self, gui: Any) -> None:
        """Add the controls."""
        self._news = gui.add_html("")
        if self._before is not None:
            gui.add_button("back to mending").on_click(lambda _: self._back())
        with gui.add_folder("push it"):
            push = gui.add_button_group("towards", tuple(_PUSHES), hint="▲: the way that it faces")
            strength = gui.add_slider("m/s", 0.1, 2.0, 0.1, 0.5)
            push.on_click(lambda e: self._push(*(strength.value * np.array(_PUSHES[e.target.value]))))
        with gui.add_folder("hinder it"):
            self._friction = gui.add_slider("friction", 0.2, 1.5, 0.05, 1.0)
            self._mass = gui.add_slider("times as heavy", 0.7, 1.5, 0.05, 1.0)
            self._delay = gui.add_slider("motors late by ms", 0, 60, 5, 0)
            again = gui.add_button("begin again, so hindered")
            again.on_click(lambda _: self._again())

    def ahead(self, frame: int) -> int:
        """Simulate up to a frame; returns the frame to show, 0 where the dance begins again."""
        dance = self._dance
        with self._busy:
            if frame < dance.frame:
                return frame  # what was danced before
            if dance.over:
                self._waits += 1
                if self._waits < _AFTER_S * dance.reference.fps:
                    return dance.frame
                self._begin(None)
                return 0
            while dance.frame < frame and not dance.over:
                dance.step()
                self._keep()
        state = f"fell at {dance.frame / dance.reference.fps:.1f} s" if dance.fell else f"{dance.off_mm:.0f} mm off"
        self._news.content = inset(f"{state}; falls: {dance.falls}")
        return dance.frame

    def _back(self) -> None:
        if self.page is not None and self._before is not None:
            self.page.present(self._before)
        with self._busy:
            self._dance.close()

    def _begin(self, hindrance: Hindrance | None) -> None:
        self._waits = 0
        self._dance.restart(hindrance)
        self._keep()

    def _push(self, forward: float, left: float) -> None:
        with self._busy:
            self._dance.push(forward, left)

    def _keep(self) -> None:
        pos, quat = forward_kinematics(self._dance.robot, self._dance.qpos[None])
        self._pos[self._dance.frame], self._quat[self._dance.frame] = pos[0], quat[0]

    def _again(self) -> None:
        from tracking.evaluation import Hindrance

        wanted = Hindrance(friction=self._friction.value, mass=self._mass.value, delay_s=1e-3 * self._delay.value)
        with self._busy:
            self._begin(wanted)
        if self.page is not None:
            self.page.go_to(0)


def tracker_of(asked: str, robot: str) -> Path | None:
    """The tracker that was asked for, None for nobody; "auto": the robot's own, where one comes with the package."""
    from tracking.policy import CONTRACT, SHIPPED

    if asked == NOBODY or (asked == AUTO and find_spec("onnxruntime") is None):
        return None
    named = Path(f"tracker-{robot}" if asked == AUTO else asked)
    return named if asked != AUTO or (SHIPPED / named / CONTRACT).is_file() else None


def live_panel_of(tracker: Path, result: Retargeted, back: Panel) -> LivePanel:
    """A tracker that dances what came of a retargeting.

    Raises:
        TrackingError: no tracker, or not one of that robot.
    """
    from tracking.evaluation import LiveDance

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "dance.npz"
        save_reference(result.reference, file)
        dance = LiveDance(tracker, result.robot.name, reference=file)
    return LivePanel(dance, tracker.name, back)
