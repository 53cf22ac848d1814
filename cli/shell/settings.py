"""Numbers of a configuration, stated by their dotted names: `--contact.tight-speed 0.3`, or in a TOML file."""

from __future__ import annotations

import difflib
import json
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from cli.shell.typed import stated
from robot_models import DanceError
from robot_models.incoming import MAX_CONFIG, parsed, read_text

C = TypeVar("C")


def split_dotted(words: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Words without `--a.b value` and `--a.b=value`, and these by their dotted names."""
    left, dotted, rest = list[str](), dict[str, str](), iter(words)
    for word in rest:
        name, equals, value = word.partition("=")
        if name.startswith("--") and "." in name:
            dotted[name[2:]] = value if equals else next(rest, "")
        else:
            left.append(word)
    return left, dotted


def from_file(config: C, path: Path | None) -> C:
    """The configuration with what a TOML file states; no file, no change.

    Raises:
        DanceError: no TOML, a name that is no setting, or a value of another kind.
    """
    if path is None:
        return config
    text = read_text(path, expected="settings (TOML)", most=MAX_CONFIG, error=DanceError)
    told = parsed(tomllib.loads, text, str(path), expected="settings (TOML)", error=DanceError)
    for name, value in _flat(told):
        config = _with(config, name.split("."), value, f"{path}, {name}", config)
    return config


def from_words(config: C) -> C:
    """The configuration with what was stated on the command line; raises as `from_file`."""
    for name, text in stated().items():
        config = _with(config, name.split("."), _value(text), f"--{name}", config)
    return config


def as_toml(config: Any, prefix: str = "") -> str:
    """Every number of a configuration, as `from_file` reads it; groups in order, what is not set left out."""
    lines, groups = [], []
    for field in fields(config):
        value = getattr(config, field.name)
        if is_dataclass(value):
            groups.append(as_toml(value, f"{prefix}{field.name}."))
        elif value is not None and not _of_groups(value):
            lines.append(f"{field.name} = {_text(value)}")
    head = f"[{prefix[:-1]}]\n" if prefix and lines else ""
    return "\n".join(filter(None, (head + "\n".join(lines) + "\n" if lines else "", *groups)))


def _text(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return f"[{', '.join(map(_text, value))}]" if isinstance(value, tuple) else json.dumps(value)


def _value(text: str) -> Any:
    """What a word says: a number, true or false, several with commas; else itself."""
    for candidate in (text, f"[{text}]"):
        try:
            return tomllib.loads(f"x = {candidate}")["x"]
        except tomllib.TOMLDecodeError:
            continue
    return text


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _with(config: C, way: Sequence[str], value: Any, where: str, whole: Any) -> C:
    """The configuration with one number of it or of its groups changed."""
    name, *deeper = (part.replace("-", "_") for part in way)
    if not is_dataclass(config) or name not in {f.name for f in fields(config)}:
        raise _unknown(where, whole)
    old = getattr(config, name)
    new = _with(old, deeper, value, where, whole) if deeper else _of_kind(value, old, where)
    return replace(config, **{name: new})  # type: ignore[type-var]


def _unknown(where: str, whole: Any) -> DanceError:
    names = sorted(_names(whole))
    asked = where.rpartition(", ")[2].removeprefix("--").replace("_", "-")
    near = difflib.get_close_matches(asked, names, n=3, cutoff=0.4)
    return DanceError(where, found="no such setting", expected=f"one like {', '.join(near or names[:5])}")


def _names(config: Any, prefix: str = "") -> Iterator[str]:
    """The dotted names of everything that can be set."""
    for field in fields(config):
        value, name = getattr(config, field.name), f"{prefix}{field.name.replace('_', '-')}"
        if is_dataclass(value):
            yield from _names(value, f"{name}.")
        elif not _of_groups(value):
            yield name


def _of_groups(value: Any) -> bool:
    return isinstance(value, tuple) and any(map(is_dataclass, value))


def _of_kind(value: Any, old: Any, where: str) -> Any:
    """A value of the kind that the setting has."""
    if is_dataclass(old) or _of_groups(old):
        raise DanceError(where, found="a group of settings", expected="one setting of it, as group.setting")
    if isinstance(old, tuple):
        several = value if isinstance(value, list) else [value]
        kind = float if any(isinstance(n, float) for n in old) else int
        if all(isinstance(n, int | float) and not isinstance(n, bool) for n in several):
            return tuple(kind(n) for n in several)
    elif isinstance(old, bool) or isinstance(value, bool):
        if type(old) is type(value):
            return value
    elif isinstance(old, float) and isinstance(value, int | float):
        return float(value)
    elif old is None or type(old) is type(value):
        return value
    raise DanceError(
        where, found=repr(value), expected=f"{type(old).__name__}, as {_text(old) if old is not None else 'a value'}"
    )
