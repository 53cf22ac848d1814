"""The controls that mend a dance: what to cut, touches and joints to state, solve again, take back, write."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from html import escape
from typing import Any

from cli.viewing.mending import Edits, Mending
from retarget import ContactEdit, KeyFrame, Retargeted
from retarget.stage import Page, Show, inset, show_retargeting
from robot_models import CONTACT_NAMES, PART_NAMES, DanceError, installed, robot_names

_KINDS = ("planted", "pivoting", "gliding", "free")


def show_of_result(result: Retargeted) -> Show:
    """What there is to see of a retargeting."""
    sources = () if result.targets is None else result.sources
    return show_retargeting(result.robot, result.reference, result.report, result.diagnoses, sources, result.dynamics)


class MendingPanel:
    """The mending of one recording on a page."""

    def __init__(self, mending: Mending) -> None:
        self._mending, self._length_s = mending, round(mending.length_s, 2)
        self._said = ""
        self._busy = threading.Lock()  # clicks come from other threads
        self.page: Page | None = None
        self.ahead = None  # nothing comes into being while it plays

    @property
    def show(self) -> Show:
        """What came of the last step."""
        return show_of_result(self._mending.result)

    def build(self, gui: Any) -> None:
        """Add the controls, with the edits of now."""
        edits = self._mending.edits
        with gui.add_folder("mend"):
            robots = [name for name in robot_names() if installed(name)]
            if edits.robot in robots:
                self._robot = gui.add_dropdown("robot", robots, initial_value=edits.robot)
            else:
                self._robot = gui.add_text("robot", edits.robot)
            end = self._length_s if edits.end is None else edits.end
            self._span = gui.add_multi_slider("seconds to keep", 0.0, self._length_s, 0.01, (edits.start, end))
            self._drop = gui.add_text("seconds to drop", " ".join(edits.drop), hint="as 13.8-14.3 20-21.5")
            self._speed = gui.add_number("times as fast", edits.speed, min=0.1, max=4.0, step=0.05)
            self._mirror = gui.add_checkbox("left and right exchanged", edits.mirror)
            self._touches(gui, edits)
            self._joints(gui, edits)
            solve = gui.add_button("solve again", color="green")
            solve.on_click(lambda _: self._solve(self._asked))
            undo = gui.add_button("take the last step back")
            undo.on_click(lambda _: self._undo())
            write = gui.add_button("write reference, recording and CSVs here")
            write.on_click(lambda _: self._write())
            self._news = gui.add_html(inset(self._said))
            gui.add_html(inset(f"what is shown, by hand:<br><code>{escape(self._mending.command)}</code>"))

    def _touches(self, gui: Any, edits: Edits) -> None:
        with gui.add_folder("state a touch", expand_by_default=bool(edits.touches)):
            edge = gui.add_dropdown("part", (*CONTACT_NAMES, *PART_NAMES))
            kind = gui.add_dropdown("does", _KINDS)
            span = gui.add_vector2("from, to [s shown]", (0.0, 1.0), step=0.01)
            here = gui.add_button("from the second that is shown")
            here.on_click(lambda _: setattr(span, "value", (self._shown(), max(span.value[1], self._shown() + 0.5))))
            gui.add_html(inset(f"the dance begins at {self._lead_s():.2f} s shown"))
            add = gui.add_button("state it")

            def state(_: Any) -> None:
                start, end = (round(s - self._lead_s(), 3) for s in span.value)
                touch = ContactEdit(start=max(0.0, start), end=end, edge=edge.value, kind=kind.value)
                self._solve(lambda: self._mending.mended(touches=(*self._mending.edits.touches, touch)))

            add.on_click(state)
            for touch in edits.touches:
                gui.add_markdown(f"{touch.edge} {touch.kind}, {touch.start:.2f} to {touch.end:.2f} s of the dance")

    def _joints(self, gui: Any, edits: Edits) -> None:
        robot = self._mending.result.robot
        with gui.add_folder("hold a joint", expand_by_default=bool(edits.keys)):
            joint = gui.add_dropdown("joint", robot.joint_names)
            angle = gui.add_number("degrees", 0.0, step=1.0)
            span = gui.add_html("")
            add = gui.add_button("hold it at the second that is shown")

            def choose(_: Any) -> None:
                j, reference = robot.joint(joint.value), self._mending.result.reference
                frame = min(round(self._shown() * reference.fps), reference.frames - 1)
                angle.value = round(math.degrees(reference.joint_pos[frame, j]), 1)
                low, high = (math.degrees(limit[j]) for limit in (robot.lower, robot.upper))
                span.content = inset(f"it turns from {low:.0f}° to {high:.0f}°")

            def hold(_: Any) -> None:
                at = round(max(0.0, self._shown() - self._lead_s()), 3)
                key = KeyFrame(time=at, joint=joint.value, value=math.radians(angle.value))
                self._solve(lambda: self._mending.mended(keys=(*self._mending.edits.keys, key)))

            joint.on_update(choose)
            choose(None)
            add.on_click(hold)
            for key in edits.keys:
                gui.add_markdown(f"{key.joint} at {math.degrees(key.value):.0f}°, {key.time:.2f} s of the dance")

    def _shown(self) -> float:
        return self.page.seconds if self.page is not None else 0.0

    def _lead_s(self) -> float:
        """Seconds shown before the dance begins."""
        reference = self._mending.result.reference
        return reference.dance.start / reference.fps

    def _asked(self) -> Edits:
        """The edits as the controls of the cut stand."""
        start, end = self._span.value
        return self._mending.mended(
            robot=self._robot.value, start=round(start, 3),
            end=None if end > self._length_s - 0.011 else round(end, 3),
            drop=tuple(self._drop.value.split()), speed=self._speed.value, mirror=self._mirror.value,
        )  # fmt: skip

    def _solve(self, edits: Callable[[], Edits]) -> None:
        before = self._mending.result

        def work() -> str:
            result = self._mending.solve(edits(), self._tell_progress)
            return f"{_gates(before)} before, {_gates(result)} now"

        self._guarded(work)

    def _undo(self) -> None:
        self._guarded(
            lambda: "the last step is taken back" if self._mending.undo() else "there is no step to take back"
        )

    def _write(self) -> None:
        self._guarded(lambda: "wrote " + ", ".join(map(str, self._mending.write())))

    def _guarded(self, work: Callable[[], str]) -> None:
        """Do it, and show what came of it; a refusal is told and changes nothing. One thing at a time."""
        if not self._busy.acquire(blocking=False):
            return
        try:
            self._said = escape(work())
            if self.page is not None:
                self.page.change(self.show)
        except DanceError as e:
            self._news.content = inset(f'<span style="color:rgb(230,55,45)">refused: {escape(str(e))}</span>')
        finally:
            self._busy.release()

    def _tell_progress(self, stage: str, done: int, total: int, note: str = "") -> None:
        self._news.content = inset(f"{escape(stage)}: {done} of {total} {escape(note)}")


def _gates(result: Retargeted) -> str:
    missed = len(result.report.failures)
    return f"{missed} gate{'s' * (missed > 1)} missed" if missed else "every gate holds"
