"""The options of `dance-robot`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from cli.shell import ClipPath, Out, TellOptions


@dataclass(frozen=True, kw_only=True)
class Add:
    """Draft the profile of a humanoid from its URDF or MJCF, and try it on a sample dance.

    Examples:
        dance-robot add my_robot.urdf
        dance-robot add my_robot.urdf --keep
        dance-robot add my_robot.xml -o robots/my_robot.toml --name my_robot
        dance-robot add menagerie:unitree_h1 --keep
    """

    model: ClipPath
    """A URDF or MJCF file; or a robot of MuJoCo Menagerie (menagerie:unitree_h1) or robot-descriptions (description:h1), by
    packages of these names (extra models)."""
    out: Out = None
    """The profile to write; default: <model>.toml in the current folder."""
    keep: bool = False
    """Keep the profile among your own robots, so that --robot NAME finds it from every folder."""
    name: str | None = None
    """Of the robot; default: the file's name."""
    overwrite: bool = False
    """Write over a profile that is there."""
    tell: TellOptions = field(default_factory=TellOptions)


@dataclass(frozen=True, kw_only=True)
class Check:
    """Try a robot: does it stand on its gains, and does a sample dance come out inside the gates?

    Examples:
        dance-robot check my_robot.toml
        dance-robot check g1
    """

    robot: Annotated[str, tyro.conf.Positional]
    """A robot's name or the path of a profile."""
    out: Out = None
    """Folder for the recording; default: the current one."""
    tell: TellOptions = field(default_factory=TellOptions)


@dataclass(frozen=True, kw_only=True)
class List:
    """The robots that have names, and which of them are installed."""

    tell: TellOptions = field(default_factory=TellOptions)


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Robots: list them, add one of your own, try one out.

    Examples:
        dance-robot list
        dance-robot add my_robot.urdf
        dance-robot check my_robot.toml
    """

    do: Annotated[
        Annotated[Add, tyro.conf.subcommand("add")]
        | Annotated[Check, tyro.conf.subcommand("check")]
        | Annotated[List, tyro.conf.subcommand("list")],
        tyro.conf.arg(name=""),
    ]
