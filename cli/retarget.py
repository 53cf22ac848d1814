"""`dance-retarget`: a mocap file and a robot in, a reference and a recording out."""

from __future__ import annotations

import time

from cli.retargeting import (
    Arguments,
    check_one,
    details_of,
    is_batch,
    read_dances,
    report_table,
    retarget_all,
    save_result,
    solve_dances,
    verdict_of,
)
from cli.shell import as_toml, command, progress, some, tell
from robot_models import load_robot


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-retarget`."""
    return command(Arguments, run, name="dance-retarget", argv=argv)


def run(args: Arguments) -> int:
    """Read, retarget, save, report."""
    some(args.clips, "a motion file, as dance.bvh")
    if is_batch(args):
        return retarget_all(args)
    check_one(args)
    robot = load_robot(args.robot)
    dances = read_dances(args)
    began = time.perf_counter()
    with progress("steps") as follow:
        result, transitions = solve_dances(dances, robot, args, follow)
    rate = result.reference.frames / (time.perf_counter() - began)
    written = save_result(result, dances, args)
    details = [
        as_toml(args.numbers()),
        *details_of(result, dances),
        report_table(result.report),
        f"{result.reference.frames} frames, retargeted at {rate:.0f} frames/s",
    ]
    return tell(verdict_of(result, transitions, dances, args, written), args.tell, details)
