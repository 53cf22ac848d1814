"""Which point is which part of the body, as the user says it: a TOML file, drafted here and confirmed there."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from clips.clip import OPTIONAL, REQUIRED
from clips.errors import ClipError
from robot_models.incoming import MAX_CONFIG, parsed, read_text

_HEADER = """\
# Which point of {file} is which part of the body.
# Drafted by names and by geometry: correct every line that is wrong, fill in those that are empty, then read the
# clip with this file as its mapping. An empty optional line may stay.
#
# Points of the file:
{points}

[landmarks]
"""


class MappingNeededError(ClipError):
    """A skeleton of which the user has to say which point is which part of the body.

    Attributes:
        draft: text of a mapping file to be confirmed.
    """

    def __init__(
        self, file: str, names: Sequence[str], guess: Mapping[str, str], *, found: str, expected: str, cure: str
    ) -> None:
        self.draft = draft(file, names, guess)
        suggestion = f"{Path(file).stem}.mapping.toml"
        super().__init__(file, found=found, expected=expected, cure=cure, option="mapping", suggestion=suggestion)


class UnknownSkeletonError(MappingNeededError):
    """A skeleton whose points no naming custom tells apart."""

    def __init__(self, file: str, names: Sequence[str], missing: Sequence[str], guess: Mapping[str, str]) -> None:
        super().__init__(
            file,
            names,
            guess,
            found=f"no point for {', '.join(missing)} among {', '.join(names)}",
            expected="hips, knees, ankles, shoulders, elbows and wrists of both sides",
            cure="name the points left_hip, left_knee, ..., or say in a mapping file which is which",
        )


class ExchangedSidesError(MappingNeededError):
    """A skeleton whose left is right in every frame, for some parts of the body."""

    def __init__(self, file: str, names: Sequence[str], parts: Sequence[str], known: Mapping[str, str]) -> None:
        other = {"left": "right", "right": "left"}
        pairs = {f"{side}_{part}": known[f"{other[side]}_{part}"] for side in other for part in parts}
        super().__init__(
            file,
            names,
            {**known, **pairs},
            found=f"left and right {', '.join(parts)} on each other's side in every frame",
            expected="left points on the person's left: where knees bend and toes point tells which it is",
            cure="exchange the names, or read it with a mapping that does",
        )


def draft(file: str, names: Sequence[str], guess: Mapping[str, str]) -> str:
    """Text of a mapping file with what was guessed."""
    points = "\n".join(f"#   {_quoted(n)}" for n in names)
    lines = [f"{k} = {_quoted(guess.get(k, ''))}" for k in REQUIRED]
    lines += ["", "# optional", *(f"{k} = {_quoted(guess.get(k, ''))}" for k in OPTIONAL)]
    return _HEADER.format(file=file, points=points) + "\n".join(lines) + "\n"


def read_mapping(path: Path, names: Sequence[str]) -> dict[str, str]:
    """Landmark -> point name.

    Raises:
        ClipError: no such file, no TOML, a landmark that is none, a point that is not among `names`, or one missing.
    """
    expected = 'lines like left_hip = "LeftUpLeg"'
    text = read_text(path, expected=f"a mapping file: {expected}", most=MAX_CONFIG, error=ClipError)
    table = parsed(tomllib.loads, text, str(path), expected=expected, error=ClipError).get("landmarks")
    if not isinstance(table, dict) or not all(isinstance(v, str) for v in table.values()):
        raise ClipError(str(path), found="no table [landmarks] of names", expected='lines like left_hip = "LeftUpLeg"')
    known = {k: v for k, v in table.items() if v}
    for landmark, point in known.items():
        for word, among in ((landmark, (*REQUIRED, *OPTIONAL)), (point, names)):
            if word not in among:
                near = difflib.get_close_matches(word, among, n=1)
                raise ClipError(
                    f"{path}, {landmark}", found=f"'{word}'", expected=f"one of {', '.join(among)}",
                    cure=f"did you mean '{near[0]}'?" if near else "",
                )  # fmt: skip
    twice = sorted({p for p in known.values() if list(known.values()).count(p) > 1})
    if twice:
        raise ClipError(str(path), found=f"'{', '.join(twice)}' for two parts of the body", expected="a point for each")
    missing = [k for k in REQUIRED if k not in known]
    if missing:
        raise ClipError(str(path), found=f"no point for {', '.join(missing)}", expected="one for each of them")
    return known


def _quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = "".join(f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else c for c in text)
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"' if escaped == text else f'"{escaped}"'
