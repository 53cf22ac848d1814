"""The robots that have names: built-in ones, and a user's own."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from cli.shell import TellOptions, Verdict, tell
from robot_models import DanceError, find_profile, installed, kept_in, load_robot, own_robots, robot_names
from robot_models.draft import menagerie_humanoids


def list_robots(options: TellOptions) -> int:
    """Tell which there are, and how to come by those that are not installed."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("robot", "", "here", "bring it"):
        table.add_column(column)
    for name in robot_names():
        profile = find_profile(name)
        table.add_row(name, profile.title, "yes" if installed(name) else "no", profile.source.install)
    for name, path in own_robots().items():
        table.add_row(*_own(name, path))
    here = [name for name in robot_names() if installed(name)]
    verdict = Verdict(
        passed=True,
        line=f"{len(here)} of {len(robot_names())} robots are here: {', '.join(here)}",
        notes=(
            *_listed(),
            f"your own are looked for in {kept_in()} and in the folders that DANCE_ROBOTS lists",
        ),
        steps=(("dance-robot add my_robot.urdf --keep", "bring your own"),),
        data={
            "robots": {name: installed(name) for name in robot_names()},
            "own": {name: str(path) for name, path in own_robots().items()},
        },
    )
    return tell(verdict, options, shown=[table])


def _listed() -> list[str]:
    """Those of a collection that is installed."""
    names = menagerie_humanoids()
    return [f"of MuJoCo Menagerie, by dance-robot add menagerie:NAME --keep: {', '.join(names)}"] if names else []


def _own(name: str, path: Path) -> tuple[str, str, str, str]:
    """A row of the list; a profile that cannot be used says why."""
    try:
        return name, load_robot(name).profile.title, "yes", str(path)
    except DanceError as e:
        return name, "cannot be used", "no", str(e)
