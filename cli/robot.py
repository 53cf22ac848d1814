"""`dance-robot`: list the robots, bring a new one, try one out."""

from __future__ import annotations

import re
from pathlib import Path

import clips.samples
from cli.retargeting import report_table
from cli.robot_arguments import Add, Arguments, Check
from cli.robot_list import list_robots
from cli.shell import TellOptions, Trouble, Verdict, command, line, make_folder, tell
from clips import OutputError, read_clip, write_whole
from retarget.workflows import check_robot
from robot_models import kept_in, load_robot, robot_names
from robot_models.draft import STANDS_S, draft_profile, in_collection, listed_robot, without_overlaps

_DRILL = Path(clips.samples.__path__[0]) / "drill.bvh"  # turns, hops, a deep knee bend, a kick, raised arms


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-robot`."""
    return command(Arguments, run, name="dance-robot", argv=argv)


def run(args: Arguments) -> int:
    """Do one of the three."""
    if isinstance(args.do, Add):
        return _add(args.do)
    if isinstance(args.do, Check):
        return _check(args.do.robot, args.do.out or Path(), args.do.tell)
    return list_robots(args.do.tell)


def _add(args: Add) -> int:
    listed = listed_robot(str(args.model)) if in_collection(str(args.model)) else None
    model = args.model if listed is None else listed.path
    name = args.name or re.sub(r"\W+", "_", model.stem if listed is None else listed.name).lower()
    if args.keep and args.out is not None:
        raise OutputError("--keep", found=f"--out {args.out} beside it", expected="one of the two")
    if args.keep and name in robot_names():
        raise OutputError(f"--name {name}", found="a built-in robot of that name", expected="another --name")
    out = (
        kept_in() / f"{name}.toml" if args.keep else args.out or Path(f"{model.stem if listed is None else name}.toml")
    )
    if args.keep:
        make_folder(out)
    if out.suffix != ".toml":
        raise OutputError(f"--out {out}", found="that name", expected="a file that ends in .toml")
    if out.exists() and not args.overwrite:
        raise OutputError(
            str(out), found="a profile that is there already", expected="a new file",
            cure=f"name another with {'--name' if args.keep else '--out'}, or say --overwrite",
        )  # fmt: skip
    rights = {} if listed is None else {"licence": listed.licence, "origin": listed.origin}
    draft = draft_profile(model, name, out, **rights)
    _write(out, draft.text)
    draft = without_overlaps(draft, out)
    _write(out, draft.text)
    guesses = (f"drafted {out}; look at each of its guesses:", *(f"  {guess}" for guess in draft.guesses))
    return _check(name if args.keep else str(out), out.parent, args.tell, guesses)


def _write(path: Path, text: str) -> None:
    with write_whole(path) as stream:
        stream.write(text.encode())


def _check(name: str, folder: Path, options: TellOptions, notes: tuple[str, ...] = ()) -> int:
    """Stand, dance, and say what to mend; a robot by its name, or the path of its profile."""
    robot = load_robot(name)
    check = check_robot(robot, read_clip(_DRILL))
    written = [folder / f"{robot.name}_check.rrd"]
    check.result.save(written[0])
    still, no_picture = folder / f"{robot.name}_check.png", ""
    try:
        check.result.save(still)
        written.append(still)
    except OutputError as e:  # no OpenGL: the recording shows the same
        no_picture = f"no picture: {e}"
    verdict = Verdict(
        passed=not check.to_mend,
        line=f"{robot.profile.title}: {f'{len(check.to_mend)} things to look at' if check.to_mend else 'ready to dance'}",
        numbers=(
            f"{robot.model.body_mass.sum():.1f} kg",
            f"root {robot.default_qpos[2]:.2f} m up",
            f"stands {check.stood_s:.1f} of {STANDS_S:.0f} s on its gains",
        ),
        notes=(*notes, *([no_picture] if no_picture else [])),
        troubles=tuple(Trouble(what=f"look at {line}") for line in check.to_mend),
        written=tuple(written),
        steps=(
            (line("rerun", written[0]), "look at it"),
            (line("dance-retarget", "CLIP", "--robot", name), "a dance of yours"),
        ),
        data={"report": check.result.report.as_dict()},
    )
    return tell(verdict, options, [report_table(check.result.report)])
