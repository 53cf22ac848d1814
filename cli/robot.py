"""`dance-robot`: list the robots, bring a new one, try one out."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

import clips.samples
from cli.terminal import BELOW_GATE, DONE, ClipPath, Out, command, print_report
from clips import OutputError, cut, read_clip, write_whole
from retarget import Retargeted, retarget
from robot_models import RobotModel, find_profile, installed, load_robot, robot_names
from robot_models.draft import draft_profile, without_overlaps

_SAMPLE = Path(clips.samples.__path__[0]) / "groove.bvh"
_TEST_S = 6.0  # of the sample clip
_STANDS_S = 3.0
_FELL = 0.7  # of the standing height of the root
# What to look at in a profile when a number of the report is off.
_HINTS = {
    "joint position": "ranges in the model file",
    "joint speed": "[joints.velocity]: is the robot that slow?",
    "joint acceleration": "[joints.effort] and [joints.armature]",
    "deepest point under the floor": "[soles.*] (z, x, y) and the capsules of feet and shins",
    "self-collision": "[capsules.*] and excludes: links that overlap by construction",
    "slide": "[soles.*], and landmarks left_foot and right_foot",
    "limb direction": "[landmarks]: hips, knees, shoulders, elbows, wrists; and whether at zero all face +x",
    "airborne": "[soles.*].z",
    "hovering": "[soles.*].z and [default_pose]",
}
_LIMB_ERROR = 20.0  # beyond which landmarks are doubted [deg]


@dataclass(frozen=True, kw_only=True)
class Add:
    """Draft the profile of a humanoid from its URDF or MJCF, and try it on a sample dance.

    Examples:
        dance-robot add my_robot.urdf
        dance-robot add my_robot.xml -o robots/my_robot.toml --name my_robot
    """

    model: ClipPath
    """A URDF or MJCF file."""
    out: Out = None
    """The profile to write; default: <model>.toml in the current folder."""
    name: str | None = None
    """Of the robot; default: the file's name."""
    overwrite: bool = False
    """Write over a profile that is there."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """Try a robot: does it stand on its gains, and does a sample dance come out inside the gates?

    Examples:
        dance-robot check my_robot.toml
        dance-robot check g1
    """

    robot: Annotated[str, tyro.conf.Positional]
    """A built-in robot or the path of a profile."""
    out: Out = None
    """Folder for the recording; default: the current one."""


@dataclass(frozen=True, kw_only=True)
class List:
    """The built-in robots, and which of them are installed."""


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


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-robot`."""
    return command(Arguments, run, name="dance-robot", argv=argv)


def run(args: Arguments) -> int:
    """Do one of the three."""
    console = Console(highlight=False, soft_wrap=True)
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
    console.print(f"wrote {out}; [bold]guessed, look at each of them[/]:")
    for guess in draft.guesses:
        console.print(f"  {guess}", markup=False)
    return _check(load_robot(str(out)), out.parent, console)


def _write(path: Path, text: str) -> None:
    with write_whole(path) as stream:
        stream.write(text.encode())


def _check(robot: RobotModel, folder: Path, console: Console) -> int:
    """Stand, dance, and say what to mend."""
    from cli.recordings import save_retargeting, save_still

    stood = standing_seconds(robot)
    console.print(
        f"{robot.profile.title}: {robot.model.body_mass.sum():.1f} kg, root {robot.default_qpos[2]:.2f} m up; "
        f"stands {stood:.1f} of {_STANDS_S:.0f} s on its gains"
    )
    result = retarget(cut(read_clip(_SAMPLE), 0.0, _TEST_S), robot)
    print_report(result.report, console)
    recording, still = folder / f"{robot.name}_check.rrd", folder / f"{robot.name}_check.png"
    save_retargeting(recording, result)
    console.print(f"wrote {recording}   open it: rerun {recording}", markup=False)
    try:
        save_still(still, result)
        console.print(f"wrote {still}: the person and the robot side by side", markup=False)
    except OutputError as e:  # no OpenGL: the recording shows the same
        console.print(f"no picture: {e}", markup=False)
    wrong = _to_mend(result, stood)
    for line in wrong:
        console.print(f"look at {line}", style="yellow", markup=False)
    if not wrong:
        console.print("[green]all gates hold[/]")
    return BELOW_GATE if wrong else DONE


def _to_mend(result: Retargeted, stood: float) -> list[str]:
    wrong = []
    if stood < _STANDS_S:
        wrong.append("[joints.kp], [joints.kd], [default_pose] and [soles.*]: it falls when it should stand")
    for metric in result.report.metrics:
        doubted = metric.name == "limb direction error" and metric.value > _LIMB_ERROR
        if not metric.passed or doubted:
            hint = next((h for k, h in _HINTS.items() if k in metric.name), "the profile")
            wrong.append(f"{hint}: {metric.name} is {metric.value:.3g} {metric.unit}")
    return wrong


def standing_seconds(robot: RobotModel) -> float:
    """How long the robot stands in its default pose on its servos alone [s], at most three."""
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = robot.default_qpos
    data.ctrl[:] = robot.default_qpos[7:]
    steps = round(_STANDS_S / model.opt.timestep)
    for step in range(steps):
        mujoco.mj_step(model, data)
        if not np.isfinite(data.qpos[2]) or data.qpos[2] < _FELL * robot.default_qpos[2]:
            return float(step * model.opt.timestep)
    return _STANDS_S
