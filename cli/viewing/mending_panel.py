"""The controls that mend a dance: what to cut, touches and joints to state, solve again, take back, write."""

from __future__ import annotations

import threading
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

from cli.viewing.hand_controls import HandControls
from cli.viewing.joint_controls import JointControls
from cli.viewing.live_panel import NOBODY, live_panel_of, tracker_of
from cli.viewing.mending import Edits, Mending
from cli.viewing.touch_controls import TouchControls
from cli.viewing.weight_controls import WeightControls
from clips import MetricKey
from retarget import Retargeted
from retarget.stage import Page, Show, inset, show_retargeting
from robot_models import DanceError, installed, robot_names


def show_of_result(result: Retargeted) -> Show:
    """What there is to see of a retargeting."""
    sources = () if result.targets is None else result.sources
    return show_retargeting(result.robot, result.reference, result.report, result.diagnoses, sources, result.dynamics)


class MendingPanel:
    """The mending of one recording on a page."""

    def __init__(self, mending: Mending, tracker: str = NOBODY) -> None:
        """Begin with what came of the whole recording.

        Args:
            mending: of it.
            tracker: what dances it with physics: a file, a name, "auto" for the robot's own, "none".
        """
        self._tracker = tracker
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
        with gui.add_folder("what this file is", expand_by_default=False):
            gui.add_markdown("\n".join(f"- {line}" for line in self._mending.recognised))
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
            solve = gui.add_button("solve again", color="green")
            solve.on_click(lambda _: self._solve(self._asked))
            undo = gui.add_button("take the last step back")
            undo.on_click(lambda _: self._undo())
            write = gui.add_button("write reference, recording and CSVs here")
            write.on_click(lambda _: self._write())
            self._news = gui.add_html(inset(self._said))
            gui.add_html(inset(f"what is shown, by hand:<br><code>{escape(self._mending.command)}</code>"))
            tracker = tracker_of(self._tracker, edits.robot)
            if tracker is not None:
                gui.add_button("dance it with physics").on_click(lambda _: self._dance(tracker))
            self._details(gui, edits)

    def _details(self, gui: Any, edits: Edits) -> None:
        """Touches, joints and weights, to be stated one by one."""
        result, mended = self._mending.result, self._mending.mended
        TouchControls(
            reference=result.reference, stated=edits.touches,
            state=lambda new: self._solve(lambda: mended(touches=(*self._mending.edits.touches, *new))),
        ).build(gui)  # fmt: skip
        JointControls(
            robot=result.robot, reference=result.reference, stated=edits.keys, shown=self._shown,
            state=lambda new: self._solve(lambda: mended(keys=(*self._mending.edits.keys, new))),
        ).build(gui)  # fmt: skip
        HandControls(
            robot=result.robot, reference=result.reference, page=lambda: self.page,
            state=lambda new: self._solve(lambda: mended(keys=(*self._mending.edits.keys, *new))),
        ).build(gui)  # fmt: skip
        WeightControls(
            stated=dict(edits.weights), state=lambda new: self._solve(lambda: mended(weights=tuple(new.items())))
        ).build(gui)

    def _shown(self) -> float:
        return self.page.seconds if self.page is not None else 0.0

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
            return f"{_gates(before)} before, {_gates(result)} now; {_changed(before, result)}"

        self._guarded(work)

    def _undo(self) -> None:
        self._guarded(
            lambda: "the last step is taken back" if self._mending.undo() else "there is no step to take back"
        )

    def _write(self) -> None:
        self._guarded(lambda: "wrote " + ", ".join(map(str, self._mending.write())))

    def _dance(self, tracker: Path) -> None:
        """Hand the page to the tracker, until it is handed back."""

        def work() -> str:
            if self.page is not None:
                self.page.present(live_panel_of(tracker, self._mending.result, self))
            return ""

        self._guarded(work, stay=False)

    def _guarded(self, work: Callable[[], str], stay: bool = True) -> None:
        """Do it, and show what came of it where the page is still ours; a refusal is told, and changes nothing."""
        if not self._busy.acquire(blocking=False):
            return
        try:
            self._said = escape(work())
            if stay and self.page is not None:
                self.page.change(self.show)
        except DanceError as e:
            self._news.content = inset(f'<span style="color:rgb(230,55,45)">refused: {escape(str(e))}</span>')
        finally:
            self._busy.release()

    def _tell_progress(self, stage: str, done: int, total: int, note: str = "") -> None:
        self._news.content = inset(f"{escape(stage)}: {done} of {total} {escape(note)}")


def _changed(before: Retargeted, now: Retargeted) -> str:
    """The numbers that a dancer asks for, before and after."""
    keys = {"feet slide": (MetricKey.SLIDE_WORST, "mm"), "limbs": (MetricKey.LIMB_DIRECTION_ERROR, "°")}
    told = {what: [r.report[key].value for r in (before, now)] for what, (key, _) in keys.items()}
    return ", ".join(f"{what} {a:.1f} → {b:.1f} {keys[what][1]}" for what, (a, b) in told.items())


def _gates(result: Retargeted) -> str:
    missed = len(result.report.failures)
    return f"{missed} gate{'s' * (missed > 1)} missed" if missed else "every gate holds"
