"""How long a dance takes to be taught.

    python benchmarks/teaching.py TEACHER REFERENCE ... [--seeds 3] [--minutes 30]

For every reference and training seed a run of `teach` on one thread, until its target or the minutes are reached; then 100
rollouts with each of two evaluation seeds, on robots that the run has not seen. Prints rows of a Markdown table.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from robot_models import load_robot
from tracking import TaskConfig, TrainConfig, evaluate, evaluation_task, load_bundle
from tracking.task import read_named_reference
from tracking.teaching import find_teacher, teach


def main() -> None:
    """Teach and judge, row by row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("teacher", help="as of dance-train --teacher")
    parser.add_argument("references", type=Path, nargs="+")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--rollouts", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=30.0)
    args = parser.parse_args()
    print("| dance | seed | labels | minutes | within the rules | stood | seconds of | body error |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for path in args.references:
        piece = read_named_reference(path)
        robot = load_robot(piece.reference.robot)
        teacher = find_teacher(args.teacher, robot.name, 1.0 / piece.reference.fps)
        assert teacher is not None, "nobody teaches"
        for seed in range(args.seeds):
            with tempfile.TemporaryDirectory() as folder:
                config = replace(TrainConfig(), seed=seed, threads=1, minutes=args.minutes)
                began = time.process_time()
                run = teach(robot, [piece], Path(folder) / "run", teacher, config)
                minutes = (time.process_time() - began) / 60.0
                bundle = load_bundle(Path(folder) / "run")
                judged = [
                    evaluate(
                        bundle.runner, bundle.robot, bundle.reference, evaluation_task(TaskConfig()),
                        rollouts=args.rollouts, seed=10_000 + k, threads=1,
                    )
                    for k in range(2)
                ]  # fmt: skip
            finished, stood, lasted, error = (
                ", ".join(form.format(getattr(r, name)) for r in judged)
                for name, form in (
                    ("finished", "{:.0%}"), ("stood", "{:.0%}"), ("stood_s", "{:.1f}"), ("body_error_mm", "{:.0f}"),
                )
            )  # fmt: skip
            print(
                f"| {piece.name}, {judged[0].duration_s:.0f} s | {seed} | {run.steps / 1e6:.2f} M | {minutes:.1f} | {finished} "
                f"| {stood} | {lasted} of {judged[0].duration_s:.1f} | {error} mm |", flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
