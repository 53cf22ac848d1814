"""The robots by name, and any other robot by the path of its profile."""

from __future__ import annotations

import difflib
from functools import lru_cache
from pathlib import Path

from robot_models.build import build_robot
from robot_models.errors import RobotError
from robot_models.model import RobotModel
from robot_models.model_file import locate
from robot_models.profile import PROFILES, RobotProfile, read_profile

DEFAULT_ROBOT = "dancer"


def robot_names() -> tuple[str, ...]:
    """Names of the built-in profiles."""
    return tuple(sorted(p.stem for p in PROFILES.glob("*.toml")))


def find_profile(name_or_path: str) -> RobotProfile:
    """A built-in profile by name, or a profile file (`.toml`), or the profile beside a URDF or MJCF file.

    Raises:
        RobotError: nothing of that name or path.
    """
    if name_or_path in robot_names():
        return _built_in(name_or_path)
    path = Path(name_or_path)
    if path.suffix in (".toml", ".urdf", ".xml", ".mjcf"):
        return read_profile(path.with_suffix(".toml"))
    near = difflib.get_close_matches(name_or_path.lower(), robot_names(), n=1)
    raise RobotError(
        f"robot '{name_or_path}'",
        found="no built-in robot and no file of that name",
        expected=f"one of {', '.join(robot_names())}, or the path of a profile (.toml)",
        cure=f"did you mean '{near[0]}'?" if near else "",
    )


def load_robot(name_or_path: str = DEFAULT_ROBOT) -> RobotModel:
    """Load and compile a robot; the same object comes back the next time, unless its profile was written anew.

    Raises:
        RobotError: unknown name, missing package, or a profile that does not fit its model file.
    """
    if name_or_path in robot_names():
        return _load(name_or_path, 0)
    profile = Path(name_or_path).with_suffix(".toml").resolve()
    return _load(str(profile) if profile.is_file() else name_or_path, _written(profile))


@lru_cache
def _built_in(name: str) -> RobotProfile:
    """A profile that comes with the package, which does not change while it is used."""
    return read_profile(PROFILES / f"{name}.toml")


@lru_cache(maxsize=8)
def _load(name_or_path: str, _modified: int) -> RobotModel:
    return build_robot(find_profile(name_or_path))


def _written(path: Path) -> int:
    return path.stat().st_mtime_ns if path.is_file() else 0


def installed(name: str) -> bool:
    """Whether the model file of a built-in robot is on this machine."""
    profile = _built_in(name)
    path = locate(profile.source, profile.folder)
    return path is not None and path.is_file()
