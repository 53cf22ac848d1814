"""Words from outside: as names of files, as patterns, and on a screen."""

from __future__ import annotations

import re
import unicodedata

from robot_models.errors import DanceError
from robot_models.incoming.limits import MAX_NAME

_HIDDEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}  # control, format (also right-to-left overrides), surrogates, line separators
_LONGEST = 150  # of a file's name [bytes]: they take 255, and suffixes come after it
_REPEATS, _GROUPS = 4, 4  # in one pattern: each more may cost as many times as a name is long


def printable(text: str) -> str:
    """The text with every character that could move a cursor or hide another one spelt out; lines stay lines."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        c
        if c in "\n\t" or unicodedata.category(c) not in _HIDDEN
        else c.encode("unicode_escape", "surrogatepass").decode()
        for c in text
    )


def file_name(text: str, *, fallback: str = "unnamed") -> str:
    """A word as the name of a file: one component, nothing hidden, no longer than file systems take."""
    kept = re.sub(r"[^\w.+-]+", "_", printable(text).replace("\\", "_")).strip("._")
    return kept.encode()[:_LONGEST].decode(errors="ignore") or fallback


def check_pattern(pattern: object, where: str, *, error: type[DanceError] = DanceError) -> str:
    """A regular expression that ends: no repeated group, and few repeats.

    Raises:
        DanceError: of the type given.
    """
    if not isinstance(pattern, str):
        raise error(where, found=repr(pattern)[:60], expected="a regular expression, in quotes")
    bare = re.sub(r"\\.|\[\^?\]?[^\]]*\]", "x", pattern)
    repeats, groups = len(re.findall(r"[*+{?]", bare.replace("(?:", "("))), bare.count("(")
    if len(pattern) > MAX_NAME or re.search(r"\)[*+{]", bare) or repeats > _REPEATS or groups > _GROUPS:
        raise error(
            where, found=f"the pattern {printable(pattern[:60])}",
            expected=f"at most {_REPEATS} repeats, none of a group, and {_GROUPS} groups",
            cure="name the joints one by one",
        )  # fmt: skip
    try:
        re.compile(pattern)
    except (re.error, RecursionError, OverflowError) as e:
        raise error(where, found=f"the pattern {printable(pattern[:60])} ({e})", expected="a regular expression") from e
    return pattern
