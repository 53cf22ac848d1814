"""The command as it was typed, to be proposed again with something changed."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from contextvars import ContextVar

_TYPED: ContextVar[tuple[str, tuple[str, ...]]] = ContextVar("typed", default=("", ()))
_STATED: ContextVar[tuple[tuple[str, str], ...]] = ContextVar("stated", default=())


def remember(name: str, words: Sequence[str], dotted: Mapping[str, str] | None = None) -> None:
    """Keep the name of a command and the words after it, and the settings among these."""
    _TYPED.set((name, tuple(words)))
    _STATED.set(tuple((dotted or {}).items()))


def stated() -> Mapping[str, str]:
    """Settings that were stated, by their dotted names."""
    return dict(_STATED.get())


def typed_name() -> str:
    """The name of the command."""
    return _TYPED.get()[0]


def again(changes: Mapping[str, str], but: Sequence[str] = ()) -> str:
    """The command that was typed with some options given anew.

    Args:
        changes: flag -> what follows it, as typed: nothing for a switch.
        but: switches that are left out.
    """
    name, words = _TYPED.get()
    left = [word for word in words if word not in but]
    for given, value in changes.items():
        left = without(left, given, len(shlex.split(value)))
    return " ".join(
        filter(None, (name, shlex.join(left), *(f"{given} {value}".rstrip() for given, value in changes.items())))
    )


def line(*words: object) -> str:
    """A command to type: names with spaces are quoted."""
    return shlex.join(map(str, words))


def without(words: Sequence[str], given: str, values: int = 1) -> list[str]:
    """Words without an option and what follows it: so many words, or more up to the next option where it takes several."""
    words = [word for word in words if not word.startswith(f"{given}=")]
    if given not in words:
        return words
    at = words.index(given)
    end = at + 1 + values
    if values > 1:  # it takes several: all up to the next option
        while end < len(words) and not words[end].startswith("-"):
            end += 1
    return words[:at] + words[end:]
