"""Robots of the field's collections by name: Google DeepMind's MuJoCo Menagerie, and robot-descriptions.

Both packages fetch a model when it is first asked for and keep it in a cache of theirs; MENAGERIE_ROOT names a checkout instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from robot_models.errors import RobotError, import_or_refuse


@dataclass(frozen=True, kw_only=True)
class Listed:
    """A robot of a collection."""

    path: Path  # of its model file
    name: str
    licence: str
    origin: str


def in_collection(text: str) -> bool:
    """Whether a name says its collection: menagerie:unitree_h1, description:h1."""
    return text.partition(":")[0] in _COLLECTIONS and ":" in text


def listed_robot(text: str) -> Listed:
    """A robot by its collection and name; it is fetched where it is not on this machine.

    Raises:
        RobotError: the package is not installed, has no such robot, or cannot fetch it.
    """
    collection, _, name = text.partition(":")
    try:
        return _COLLECTIONS[collection](name)
    except RobotError:
        raise
    except Exception as e:  # of names, networks and checkouts, each in its own way
        raise RobotError(
            text, found=f"no model of it ({type(e).__name__}: {e})",
            expected="a robot of that collection, and a network to fetch it",
            cure="dance-robot list names those of Menagerie; MENAGERIE_ROOT may name a checkout of it",
        ) from e  # fmt: skip


def menagerie_humanoids() -> tuple[str, ...]:
    """The humanoids of Menagerie by name; none where the package is not installed."""
    if find_spec("mujoco_menagerie") is None:
        return ()
    return tuple(robot.name for robot in import_module("mujoco_menagerie").robots("humanoid"))


def _refusal(package: str) -> RobotError:
    cure = f"pip install {package}, or draft from a model file of your own"
    return RobotError("collection", found=f"no package {package}", expected="it installed", cure=cure)


def _of_menagerie(name: str) -> Listed:
    robot: Any = import_or_refuse("mujoco_menagerie", _refusal("mujoco-menagerie")).get(name)
    model = robot.default_model
    return Listed(path=Path(robot.xml(model)), name=name, licence=robot.license, origin=f"MuJoCo Menagerie, {name}")


def _of_descriptions(name: str) -> Listed:
    import_or_refuse("robot_descriptions", _refusal("robot_descriptions"))
    endings = ("_mj_description", "_description")
    module = next(
        (f"robot_descriptions.{name}{end}" for end in endings if find_spec(f"robot_descriptions.{name}{end}")), ""
    )
    if not module:
        raise RobotError(f"description:{name}", found="no robot of that name", expected="one of robot-descriptions")
    told = import_module(module)  # this fetches it
    path = getattr(told, "MJCF_PATH", None) or told.URDF_PATH
    return Listed(path=Path(path), name=name, licence="see its repository", origin=f"robot-descriptions, {module}")


_COLLECTIONS: Mapping[str, Callable[[str], Listed]] = {"menagerie": _of_menagerie, "description": _of_descriptions}
