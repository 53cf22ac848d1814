"""Whether a teacher that focused on some dances still follows the others.

    python benchmarks/forgetting.py BEFORE/teacher.pt AFTER/teacher.pt REFERENCE ... [--focused NAME ...]

Both are judged on the same drawn robots and starts: 32 starts along every reference, two seconds each, and 8 rollouts from its
beginning, ten seconds at most. Rehearsal sets are taken apart. Prints a row a reference, the means, and the error of the
mean difference over references.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from clips import is_reference
from robot_models import load_robot
from tracking.evaluation import Standing
from tracking.task import NamedReference, read_named_reference, read_rehearsal_set
from tracking.teaching import judge_teacher, load_teacher, teacher_actor, teaching_task

_AT_ONCE = 8  # references: 320 robots


def main() -> None:
    """Judge twice, compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("teachers", type=Path, nargs=2)
    parser.add_argument("references", type=Path, nargs="+")
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--focused", nargs="*", default=[], help="names of what the second focused on")
    args = parser.parse_args()
    robot = load_robot(args.robot)
    pieces = [
        piece
        for file in args.references
        for piece in ([read_named_reference(file)] if is_reference(file) else read_rehearsal_set(file, robot))
    ]
    before, after = ([*_judged(teacher, args.robot, pieces)] for teacher in args.teachers)
    print(
        "| reference | stand two seconds, before | after | seconds of the first ten, before | after |\n|---|---|---|---|---|"
    )
    for one, two in zip(before, after, strict=True):
        print(f"| {one.name} | {one.stand:.2f} | {two.stand:.2f} | {one.seconds:.1f} | {two.seconds:.1f} |")
    others = [(a, b) for a, b in zip(before, after, strict=True) if not any(n in a.name for n in args.focused)]
    for what in ("stand", "seconds"):
        old, new = (np.array([getattr(pair[k], what) for pair in others]) for k in (0, 1))
        error = float(np.std(new - old, ddof=1) / np.sqrt(len(others)))
        print(
            f"{what}, {len(others)} others: {old.mean():.3f} before, {new.mean():.3f} after, {error:.3f} error of the difference"
        )


def _judged(file: Path, name: str, pieces: list[NamedReference]) -> list[Standing]:
    robot, told = load_robot(name), load_teacher(file)
    task = teaching_task(robot, [pieces[0].reference], told.config)
    actor = teacher_actor(told, task)
    task.close()
    some = [pieces[i : i + _AT_ONCE] for i in range(0, len(pieces), _AT_ONCE)]
    return [found for group in some for found in judge_teacher(actor, robot, group, starts=32, openings=8)]


if __name__ == "__main__":
    main()
