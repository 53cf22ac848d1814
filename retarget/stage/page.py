"""A page in the browser that plays a show: the time line, what is seen, the report, and the moments to jump to."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

from numpy import ndarray

from clips import OutputError
from retarget.stage.lanes import inset, lanes_svg, legend, playhead, report_table
from retarget.stage.scene import SIDE_M, Scene
from retarget.stage.show import Show
from robot_models import import_or_refuse

_WIDE = 420  # of the panel [px]
_PANEL_M = 0.45  # by which all stand further left, for the panel is at the right
_TOLD_S = 0.1  # between two moves of the time line
_MOST_MOMENTS = 8
_SPEEDS = ("0.1", "0.25", "0.5", "1", "2")


def viser() -> Any:
    """The package, or how to come by it."""
    cure = "pip install 'dance-retarget[view]'"
    return import_or_refuse("viser", OutputError("page", found="no package viser", expected="it installed", cure=cure))


def open_server(host: str, port: int) -> Any:
    """A server that shows nothing yet, on the port or the next free one.

    Raises:
        OutputError: viser is not installed, or there is no such address.
    """
    package = viser()
    if not 0 <= port < 65536:
        raise OutputError(f"port {port}", found="no port", expected="0 to 65535", option="port", suggestion="8080")
    try:
        socket.getaddrinfo(host, port)
    except OSError as e:
        raise OutputError(
            f"host {host}", found=f"no address ({e})", expected="127.0.0.1, or 0.0.0.0", option="host"
        ) from e
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # what knocks and goes away is no news
    with _silence():
        return package.ViserServer(host=host, port=port, label="dance", verbose=False)


def close_server(server: Any) -> None:
    """End it."""
    with _silence():
        server.stop()


def _silence() -> contextlib.AbstractContextManager[object]:
    """It prints a table of addresses and its end, quiet or not."""
    return contextlib.redirect_stdout(io.StringIO())


def look_from_the_front(server: Any, show: Show, aside_m: float = 0.0) -> None:
    """Where every visitor's camera begins: all who stand side by side are seen, so far left of the middle."""
    wide = SIDE_M * max([int(bool(show.people)), *(figure.place for figure in show.figures)])
    middle, away = 0.5 * wide + aside_m, 4.2 + 0.8 * wide
    camera = server.initial_camera
    camera.position, camera.look_at, camera.fov = (away, middle - 0.4, 0.35 * away), (0.0, middle, 0.72), 0.62


@runtime_checkable
class Panel(Protocol):
    """A show, and what can be done beside looking at it."""

    page: Page | None

    @property
    def show(self) -> Show:
        """What there is to see."""

    @property
    def ahead(self) -> Callable[[int], int] | None:
        """As of `Page`."""

    def build(self, gui: Any) -> None:
        """Add controls to the page, given viser's `gui`."""


class Page:
    """A show on a server; plays as soon as it is there."""

    def __init__(
        self,
        server: Any,
        show: Show,
        panel: Callable[[Any], None] | None = None,
        ahead: Callable[[int], int] | None = None,
    ) -> None:
        """Begin to show.

        Args:
            server: of `open_server`.
            show: what there is to see.
            panel: adds more to the page's controls, given viser's `gui`; again after every `change`.
            ahead: of a show that comes into being while it plays: makes frames up to the one asked for, and says which of
                them to show.
        """
        self._server, self._show, self._panel, self._ahead = server, show, panel, ahead
        self._frame, self._playing, self._speed = 0.0, True, 1.0
        self._moving = threading.RLock()  # clicks come from other threads
        server.gui.configure_theme(control_layout="fixed", control_width="large", show_logo=False,
                                   show_share_button=False, dark_mode=False)  # fmt: skip
        self.change(show)

    def handle(self, place_w: ndarray) -> Any:
        """Stop, and put arrows at a place of the first figure's world, to be dragged; their `position` is where they are [m]."""
        with self._moving:
            self._pause(True)
            return self._server.scene.add_transform_controls(
                "/world/figure_0/handle",
                scale=0.25,
                disable_rotations=True,
                depth_test=False,
                position=tuple(place_w.tolist()),
            )

    def present(self, panel: Panel) -> None:
        """Show something else, with other controls, from its beginning on."""
        with self._moving:
            self._panel, self._ahead, panel.page = panel.build, panel.ahead, self
            self._frame = 0.0
            self._pause(False)
            self.change(panel.show)

    def change(self, show: Show) -> None:
        """Show something else, from the same second on."""
        with self._moving:
            seconds = self._frame / self._show.fps
            self._server.gui.reset()
            self._server.scene.reset()
            look_from_the_front(self._server, show, _PANEL_M)
            self._show, self._scene = show, Scene(self._server.scene, show)
            self._build(self._server.gui)
            self.go_to(seconds * show.fps)

    @property
    def seconds(self) -> float:
        """That are shown."""
        return self.frame / self._show.fps

    @property
    def frame(self) -> int:
        """That is shown."""
        return int(self._frame)

    def play(self, until: Callable[[], bool]) -> None:
        """Move on, in real time, for as long as `until` is false."""
        before, told = time.perf_counter(), 0.0
        while not until():
            now = time.perf_counter()
            if self._playing:
                with self._moving:
                    self._advance((now - before) * self._speed * self._show.fps)
                    if now - told > _TOLD_S:
                        self._tell()
                        told = now
            before = now
            time.sleep(max(0.002, 1.0 / min(self._show.fps, 50.0) - (time.perf_counter() - now)))

    def go_to(self, frame: float) -> None:
        """Show a frame and tell the time line."""
        with self._moving:
            self._frame = min(max(frame, 0.0), self._show.frames - 1.0)
            self._move()
            self._tell()

    def _advance(self, frames: float) -> None:
        self._frame += frames
        if self._ahead is not None:
            shown = self._ahead(min(int(self._frame), self._show.frames - 1))
            self._frame = self._frame if shown == int(self._frame) else float(shown)
        elif self._frame > self._show.frames - 1:
            self._frame = 0.0 if self._loop.value else self._show.frames - 1.0
            self._pause(not self._loop.value)
        self._move()

    def _move(self) -> None:
        with self._server.atomic():
            self._scene.go_to(self.frame)

    def _tell(self) -> None:
        seconds = round(self.frame / self._show.fps, 3)
        if abs(self._time.value - seconds) > 1e-6:
            self._time.value = seconds
        if self._show.lanes:
            self._mark.content = inset(playhead(self._show, self.frame, _WIDE))

    def _pause(self, on: bool) -> None:
        self._playing = not on
        self._button.label = "play" if on else "pause"

    def _build(self, gui: Any) -> None:
        show = self._show
        gui.add_markdown(f"**{show.title}**\n\n{show.verdict}")
        self._button = gui.add_button("pause" if self._playing else "play", hint="space")
        self._button.on_click(lambda _: self._pause(self._playing))
        end = round((show.frames - 1) / show.fps, 3)
        self._time = gui.add_slider("seconds", 0.0, max(end, 0.001), round(1.0 / show.fps, 4), 0.0)
        self._time.on_update(self._dragged)
        if show.lanes:
            gui.add_html(inset(lanes_svg(show, _WIDE)))
        self._mark = gui.add_html("", visible=bool(show.lanes))
        if show.lanes:
            gui.add_html(inset(legend()))
        steps = gui.add_button_group("step", ("◀◀ begin", "◀ frame", "frame ▶"))
        steps.on_click(lambda e: self._step({"◀ frame": -1, "frame ▶": 1}.get(e.target.value)))
        speed = gui.add_dropdown("speed", _SPEEDS, initial_value="1")
        speed.on_update(lambda _: setattr(self, "_speed", float(speed.value)))
        self._loop = gui.add_checkbox("loop", True, visible=self._ahead is None)
        self._switches(gui)
        self._keys(gui)
        if self._panel is not None:
            self._panel(gui)
        if show.moments:
            with gui.add_folder("what is wrong, and where"):
                for seconds, text in show.moments[:_MOST_MOMENTS]:
                    jump = gui.add_button(f"{seconds:.2f} s", hint=text)
                    jump.on_click(lambda _, s=seconds: self._jump(s))
                    gui.add_markdown(text)
        if show.rows:
            with gui.add_folder("report", expand_by_default=not show.moments):
                gui.add_html(inset(report_table(show)))

    def _switches(self, gui: Any) -> None:
        """What is seen of the show; only switches for what it has."""
        show, scene = self._show, self._scene
        figures = show.figures
        wanted: list[tuple[str, bool, Callable[[bool], None]]] = [("follow the robot", True, scene.follow)]
        if show.people or any(f.place for f in figures):
            wanted.append(("side by side", True, scene.stand_apart))
        if show.people:
            wanted.append(("the person", True, scene.show_people))
        if any(f.ghost for f in figures):
            wanted.append(("where it should be", True, scene.show_ghosts))
        if any(f.contact is not None for f in figures):
            wanted.append(("contacts", True, scene.show_soles))
        if show.arrows:
            wanted.append(("forces", True, scene.show_forces))
        for label, value, switch in wanted:
            box = gui.add_checkbox(label, value)
            box.on_update(lambda e, s=switch: self._switch(s, e.target.value))

    def _switch(self, switch: Callable[[bool], None], on: bool) -> None:
        with self._moving:
            switch(on)
            self._move()

    def _keys(self, gui: Any) -> None:
        for label, key, act in (
            ("play or pause", "space", lambda: self._pause(self._playing)),
            ("a frame back", "arrowleft", lambda: self._step(-1)),
            ("a frame on", "arrowright", lambda: self._step(1)),
            ("to the beginning", "home", lambda: self._step(None)),
        ):
            gui.add_command(label, hotkey=key).on_trigger(lambda _, act=act: act())

    def _step(self, frames: int | None) -> None:
        """So many frames on, or to the beginning."""
        self._pause(True)
        self.go_to(0 if frames is None else self.frame + frames)

    def _jump(self, seconds: float) -> None:
        self._pause(True)
        self.go_to(seconds * self._show.fps)

    def _dragged(self, event: Any) -> None:
        if event.client is None:  # set by the page itself
            return
        self._pause(True)
        self.go_to(event.target.value * self._show.fps)
