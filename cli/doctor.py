"""`dance-doctor`: what is installed and works on this machine, and the line that installs what does not."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version

from rich.table import Table
from rich.text import Text

from cli.shell import PARTS, TellOptions, Verdict, command, made_for, tell
from robot_models import DanceError, import_or_refuse

_ELSEWHERE = "has no wheel for this machine, for"


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Say which parts are installed and can be imported, which robots load, and what else this machine has.

    Examples:
        dance-doctor
    """

    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-doctor`."""
    return command(Arguments, run, name="dance-doctor", argv=argv)


def run(args: Arguments) -> int:
    """One table, then what to type."""
    os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")
    table, cures, parts = (
        Table(box=None, pad_edge=False, show_header=False),
        list[tuple[str, str]](),
        dict[str, list[str]](),
    )
    for extra, (what, needed) in PARTS.items():
        states = parts[extra] = [_state(*part) for part in needed]
        wrong = [s for s in states if not s.endswith("ok")]
        table.add_row(_mark(not wrong), extra, what, ", ".join(wrong) or f"{len(needed)} packages")
        if any(_ELSEWHERE not in s for s in wrong):
            install = "dance-retarget" + ("" if extra == "base" else f"[{extra}]")
            cures.append((what, f"pip install -c tested-versions.txt '{install}'"))
    for name, value in _machine().items():
        table.add_row("", name, value, "")
    for name, (fine, said) in _robots().items():
        table.add_row(_mark(fine), f"robot {name}", said, "")
    broken = any("retargeting" in what for what, _ in cures)
    missing = f"; {len(cures)} of {len(PARTS)} parts are not here" if cures else "; every part is here"
    verdict = Verdict(
        passed=not broken,
        line=f"{'retargeting cannot work' if broken else 'retargeting works'}{missing}",
        steps=tuple((cure, f"for {what}") for what, cure in cures),
        data={"parts": parts, "machine": _machine()},
    )
    return tell(verdict, args.tell, shown=[table])


def _state(distribution: str, module: str) -> str:
    """`name version ok`, or what is wrong."""
    try:
        found = version(distribution)
    except PackageNotFoundError:
        elsewhere = made_for(distribution)
        return f"{distribution}: {_ELSEWHERE} {elsewhere}" if elsewhere else f"{distribution} missing"
    try:
        if module:
            import_or_refuse(module, DanceError(distribution, found="no import", expected="one"))
    except Exception as e:  # a broken binary package raises whatever it likes
        cause = e.__cause__ or e
        return f"{distribution} {found} does not import ({type(cause).__name__}: {cause})"
    return f"{distribution} {found} ok"


def _machine() -> dict[str, str]:
    from robot_models.maths import available_threads

    display = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    windows = "here" if display or not sys.platform.startswith("linux") else "none: use --film and rerun elsewhere"
    gpu = "nvidia-smi is here; nothing needs it" if shutil.which("nvidia-smi") else "none, and none is needed"
    return {
        "Python": f"{platform.python_version()} on {platform.system()} {platform.machine()}",
        "threads": f"{available_threads()} of {os.cpu_count()}",
        "display": windows,
        "GPU": gpu,
    }


def _robots() -> dict[str, tuple[bool, str]]:
    from robot_models import load_robot, robot_names

    found = {}
    for name in robot_names():
        try:
            robot = load_robot(name)
            found[name] = True, f"{len(robot.joint_names)} joints, {robot.model.body_mass.sum():.1f} kg"
        except DanceError as e:
            found[name] = False, str(e)
    return found


def _mark(fine: bool) -> Text:
    return Text("ok", style="green") if fine else Text("--", style="red")
