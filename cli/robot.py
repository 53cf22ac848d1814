"""`dance-robot`: list the robots, bring a new one, try one out."""

from __future__ import annotations

import re
from pathlib import Path

from rich.console import Console
from rich.table import Table

import clips.samples
from cli.retargeting import report_table
from cli.robot_arguments import Add, Arguments, Check
from cli.shell import BELOW_GATE, DONE, command, make_console
from clips import OutputError, cut, read_clip, write_whole
from retarget.workflows import check_robot
from robot_models import RobotModel, find_profile, installed, load_robot, robot_names
from robot_models.draft import STANDS_S, draft_profile, without_overlaps

_SAMPLE = Path(clips.samples.__path__[0]) / "groove.bvh"
_TEST_S = 6.0  # of the sample clip


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-robot`."""
    return command(Arguments, run, name="dance-robot", argv=argv)


def run(args: Arguments) -> int:
    """Do one of the three."""
    console = make_console()
    if isinstance(args.do, Add):
        return _add(args.do, console)
    if isinstance(args.do, Check):
        return _check(load_robot(args.do.robot), args.do.out or Path(), console)
    return _list(console)


def _list(console: Console) -> int:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("robot", "", "here", "bring it"):
        table.add_column(column)
    for name in robot_names():
        profile = find_profile(name)
        table.add_row(name, profile.title, "yes" if installed(name) else "no", profile.source.install)
    console.print(table)
    return DONE


def _add(args: Add, console: Console) -> int:
    name = args.name or re.sub(r"\W+", "_", args.model.stem).lower()
    out = args.out or Path(f"{args.model.stem}.toml")
    if out.suffix != ".toml":
        raise OutputError(f"--out {out}", found="that name", expected="a file that ends in .toml")
    if out.exists() and not args.overwrite:
        raise OutputError(
            str(out), found="a profile that is there already", expected="a new file",
            cure="name another with --out, or say --overwrite",
        )  # fmt: skip
    draft = draft_profile(args.model, name, out)
    _write(out, draft.text)
    draft = without_overlaps(draft, out)
    _write(out, draft.text)
    console.print(f"wrote {out}; guessed, look at each of them:", style="bold")
    for guess in draft.guesses:
        console.print(f"  {guess}")
    return _check(load_robot(str(out)), out.parent, console)


def _write(path: Path, text: str) -> None:
    with write_whole(path) as stream:
        stream.write(text.encode())


def _check(robot: RobotModel, folder: Path, console: Console) -> int:
    """Stand, dance, and say what to mend."""
    from cli.recordings import save_retargeting, save_still

    check = check_robot(robot, cut(read_clip(_SAMPLE), 0.0, _TEST_S))
    console.print(
        f"{robot.profile.title}: {robot.model.body_mass.sum():.1f} kg, root {robot.default_qpos[2]:.2f} m up; "
        f"stands {check.stood_s:.1f} of {STANDS_S:.0f} s on its gains"
    )
    console.print(report_table(check.result.report))
    recording, still = folder / f"{robot.name}_check.rrd", folder / f"{robot.name}_check.png"
    save_retargeting(recording, check.result)
    console.print(f"wrote {recording}   open it: rerun {recording}")
    try:
        save_still(still, check.result)
        console.print(f"wrote {still}: the person and the robot side by side")
    except OutputError as e:  # no OpenGL: the recording shows the same
        console.print(f"no picture: {e}")
    for line in check.to_mend:
        console.print(f"look at {line}", style="yellow")
    if not check.to_mend:
        console.print("all gates hold", style="green")
    return BELOW_GATE if check.to_mend else DONE
