"""A hand on the page that is dragged to where it shall be in the second that is shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from clips import Reference
from retarget import KeyFrame
from retarget.per_frame import reach
from retarget.stage import Page, inset
from robot_models import RobotModel

_HANDS = {"left hand": "left_wrist", "right hand": "right_wrist"}


@dataclass(kw_only=True)
class HandControls:
    """A folder of controls.

    Args:
        robot: whose hands.
        reference: what is shown.
        page: where it is shown.
        state: told what is stated now.
    """

    robot: RobotModel
    reference: Reference
    page: Callable[[], Page | None]
    state: Callable[[tuple[KeyFrame, ...]], None]

    def build(self, gui: Any) -> None:
        """Add them."""
        self._held: Any = None
        with gui.add_folder("drag a hand", expand_by_default=False):
            self._hand = gui.add_dropdown("hand", tuple(_HANDS))
            gui.add_button("take it").on_click(lambda _: self._take())
            gui.add_button("hold it where it is dragged").on_click(lambda _: self._hold())
            self._news = gui.add_html("")

    def _take(self) -> None:
        """Put three arrows at the hand."""
        page = self.page()
        if page is None:
            return
        self._frame = min(page.frame, self.reference.frames - 1)
        pos, quat = self.reference.body_pos_w[self._frame], self.reference.body_quat_w[self._frame]
        self._held = page.handle(self.robot.landmark_pos((_HANDS[self._hand.value],), pos, quat)[0])

    def _hold(self) -> None:
        """State the angles that bring it there."""
        if self._held is None:
            self._news.content = inset("take it first")
            return
        place = np.asarray(self._held.position, dtype=float)
        angles, off = reach(self.robot, self.reference.qpos[self._frame], _HANDS[self._hand.value], place)
        at = round(max(0.0, (self._frame - self.reference.dance.start) / self.reference.fps), 3)
        if off > 0.02:
            self._news.content = inset(f"{100 * off:.0f} cm out of its reach: it goes as far as it can")
        self.state(tuple(KeyFrame(time=at, joint=name, value=angle) for name, angle in angles.items()))
