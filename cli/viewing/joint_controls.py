"""Joints on the page: one is held at an angle in the second that is shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from clips import Reference
from retarget import KeyFrame
from retarget.stage import inset
from robot_models import RobotModel


@dataclass(kw_only=True)
class JointControls:
    """A folder of controls.

    Args:
        robot: whose joints.
        reference: what is shown.
        stated: what has been stated before.
        shown: the second that is shown.
        state: told what is stated now.
    """

    robot: RobotModel
    reference: Reference
    stated: Sequence[KeyFrame]
    shown: Callable[[], float]
    state: Callable[[KeyFrame], None]

    def build(self, gui: Any) -> None:
        """Add them."""
        with gui.add_folder("hold a joint", expand_by_default=bool(self.stated)):
            self._joint = gui.add_dropdown("joint", self.robot.joint_names)
            self._angle = gui.add_number("degrees", 0.0, step=1.0)
            self._range = gui.add_html("")
            gui.add_button("hold it at the second that is shown").on_click(lambda _: self._hold())
            self._joint.on_update(lambda _: self._chosen())
            for key in self.stated:
                gui.add_markdown(f"{key.joint} at {math.degrees(key.value):.0f}°, {key.time:.2f} s of the dance")
            self._chosen()

    def _chosen(self) -> None:
        """Begin with the angle that it has."""
        j, reference = self.robot.joint(self._joint.value), self.reference
        frame = min(round(self.shown() * reference.fps), reference.frames - 1)
        self._angle.value = round(math.degrees(reference.joint_pos[frame, j]), 1)
        low, high = (math.degrees(limit[j]) for limit in (self.robot.lower, self.robot.upper))
        self._range.content = inset(f"it turns from {low:.0f}° to {high:.0f}°")

    def _hold(self) -> None:
        lead_s = self.reference.dance.start / self.reference.fps
        at = round(max(0.0, self.shown() - lead_s), 3)
        self.state(KeyFrame(time=at, joint=self._joint.value, value=math.radians(self._angle.value)))
