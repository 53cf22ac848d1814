"""Touches on the page: each that was found, its ends to be dragged and its kind to be changed; or a new one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from clips import FREE, GLIDING, PIVOTING, PLANTED, Reference
from retarget import ContactEdit
from retarget.stage import inset
from robot_models import CONTACT_NAMES, PART_NAMES

_KINDS = {PLANTED: "planted", PIVOTING: "pivoting", GLIDING: "gliding", FREE: "free"}
_NEW = "a new one"
_SHORTEST_S = 0.02


def touches_of(reference: Reference, part: str) -> list[ContactEdit]:
    """The touches of an edge or another part, in seconds of the dance."""
    if part in CONTACT_NAMES:
        kinds = reference.contact[reference.dance, CONTACT_NAMES.index(part)]
    elif reference.part_contact is not None:
        kinds = reference.part_contact[reference.dance, PART_NAMES.index(part)]
    else:
        return []
    edges = np.flatnonzero(np.diff(kinds, prepend=-1, append=-1))
    runs = [(int(a), int(b), int(kinds[a])) for a, b in pairwise(edges)]
    return [
        ContactEdit(start=a / reference.fps, end=b / reference.fps, edge=part, kind=_KINDS[kind])
        for a, b, kind in runs
        if kind != FREE
    ]


def moved(old: ContactEdit | None, new: ContactEdit) -> tuple[ContactEdit, ...]:
    """What states a touch anew: itself, and nothing where it was before and is not now."""
    gone = []
    if old is not None:
        if new.start - old.start > _SHORTEST_S:
            gone.append(ContactEdit(start=old.start, end=new.start, edge=old.edge, kind="free"))
        if old.end - new.end > _SHORTEST_S:
            gone.append(ContactEdit(start=new.end, end=old.end, edge=old.edge, kind="free"))
    return (*gone, new)


@dataclass(kw_only=True)
class TouchControls:
    """A folder of controls.

    Args:
        reference: what is shown.
        stated: what has been stated before.
        state: told what is stated now.
    """

    reference: Reference
    stated: Sequence[ContactEdit]
    state: Callable[[tuple[ContactEdit, ...]], None]

    def build(self, gui: Any) -> None:
        """Add them."""
        seconds = (self.reference.dance.stop - 1 - self.reference.dance.start) / self.reference.fps
        with gui.add_folder("touches", expand_by_default=bool(self.stated)):
            self._part = gui.add_dropdown("part", (*CONTACT_NAMES, *PART_NAMES))
            self._which = gui.add_dropdown("touch", (_NEW,))
            begin = self.reference.dance.start / self.reference.fps
            self._span = gui.add_multi_slider("its ends", 0.0, round(seconds, 2), 0.02, (0.0, min(1.0, seconds)))
            self._kind = gui.add_dropdown("does", tuple(_KINDS.values()))
            gui.add_html(inset(f"seconds of the dance, which begins at {begin:.2f} s shown"))
            gui.add_button("solve with it").on_click(lambda _: self._state())
            self._part.on_update(lambda _: self._list())
            self._which.on_update(lambda _: self._chosen())
            for touch in self.stated:
                gui.add_markdown(f"{touch.edge} {touch.kind}, {touch.start:.2f} to {touch.end:.2f} s of the dance")
            self._list()

    def _list(self) -> None:
        """The touches of the part."""
        found = touches_of(self.reference, self._part.value)
        self._found = {f"{t.start:.2f} to {t.end:.2f} s, {t.kind}": t for t in found}
        self._which.options = (*self._found, _NEW)
        self._which.value = self._which.options[0]
        self._chosen()

    def _chosen(self) -> None:
        """Put the handles at the ends of the touch."""
        touch = self._found.get(self._which.value)
        if touch is not None:
            self._span.value, self._kind.value = (round(touch.start, 2), round(touch.end, 2)), touch.kind

    def _state(self) -> None:
        start, end = self._span.value
        new = ContactEdit(start=round(start, 3), end=round(end, 3), edge=self._part.value, kind=self._kind.value)
        self.state(moved(self._found.get(self._which.value), new))
