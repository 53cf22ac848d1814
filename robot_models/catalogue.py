"""The robots by name, a user's own ones too, and any other robot by the path of its profile."""

from __future__ import annotations

import difflib
import os
from functools import lru_cache
from pathlib import Path

import platformdirs

from robot_models.build import build_robot
from robot_models.errors import RobotError
from robot_models.model import RobotModel
from robot_models.model_file import locate
from robot_models.profile import PROFILES, RobotProfile, read_profile
from robot_models.variant import SIGN, variant_of

DEFAULT_ROBOT = "dancer"


def robot_names() -> tuple[str, ...]:
    """Names of the built-in profiles."""
    return tuple(sorted(p.stem for p in PROFILES.glob("*.toml")))


def kept_in() -> Path:
    """The folder of this user's configuration that own profiles are kept in; it need not be there."""
    return Path(platformdirs.user_config_dir("dance-retarget", appauthor=False)) / "robots"


def own_robots() -> dict[str, Path]:
    """A user's own profiles by name: of the folders that DANCE_ROBOTS lists, then of the configuration; the first wins.

    A built-in robot's name stays the built-in robot's.
    """
    folders = [Path(folder) for folder in os.environ.get("DANCE_ROBOTS", "").split(os.pathsep) if folder]
    found: dict[str, Path] = {}
    for folder in (*folders, kept_in()):
        for path in sorted(folder.glob("[!.]*.toml")):
            found.setdefault(path.stem, path)
    return {name: path for name, path in found.items() if name not in robot_names()}


def find_profile(name_or_path: str) -> RobotProfile:
    """A profile by name, built-in or a user's own, or of a variant (`g1@without_wrists`).

    Or a profile file (`.toml`), or the profile beside a URDF or MJCF file.

    Raises:
        RobotError: nothing of that name or path.
    """
    if name_or_path in robot_names():
        return _built_in(name_or_path)
    collection, _, listed = name_or_path.partition(":")
    if collection in ("menagerie", "description") and listed:
        if listed in own_robots():
            return read_profile(own_robots()[listed])
        raise RobotError(
            f"robot '{name_or_path}'", found="no profile of it yet", expected="one that was drafted and kept",
            cure=f"keep one: dance-robot add {name_or_path}",
        )  # fmt: skip
    base, sign, variant = name_or_path.rpartition(SIGN)
    if sign and (base in robot_names() or base in own_robots()):
        return variant_of(find_profile(base), variant)
    path = Path(name_or_path)
    if path.suffix in (".toml", ".urdf", ".xml", ".mjcf"):
        return read_profile(path.with_suffix(".toml"))
    own = own_robots()
    if name_or_path in own:
        return read_profile(own[name_or_path])
    known = (*robot_names(), *own)
    near = difflib.get_close_matches(name_or_path.lower(), known, n=1)
    raise RobotError(
        f"robot '{name_or_path}'",
        found="no robot and no file of that name",
        expected=f"one of {', '.join(known)}, or the path of a profile (.toml)",
        cure=f"did you mean '{near[0]}'?" if near else "draft one of your own with 'dance-robot add'",
    )


def load_robot(name_or_path: str = DEFAULT_ROBOT) -> RobotModel:
    """Load and compile a robot; the same object comes back the next time, unless its profile was written anew.

    Raises:
        RobotError: unknown name, missing package, or a profile that does not fit its model file.
    """
    if name_or_path in robot_names():
        return _load(name_or_path, 0)
    beside = Path(name_or_path).with_suffix(".toml")
    own = own_robots() if not beside.is_file() else {}
    profile = own.get(name_or_path, beside).resolve()
    return _load(str(profile) if profile.is_file() else name_or_path, _written(profile))


@lru_cache
def _built_in(name: str) -> RobotProfile:
    """A profile that comes with the package, which does not change while it is used."""
    return read_profile(PROFILES / f"{name}.toml")


@lru_cache(maxsize=32)
def _load(name_or_path: str, _modified: int) -> RobotModel:
    return build_robot(find_profile(name_or_path))


def _written(path: Path) -> int:
    return path.stat().st_mtime_ns if path.is_file() else 0


def installed(name: str) -> bool:
    """Whether the model file of a built-in robot is on this machine."""
    profile = _built_in(name)
    path = locate(profile.source, profile.folder)
    return path is not None and path.is_file()
