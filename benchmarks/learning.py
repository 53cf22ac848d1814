"""What training runs came to: their curves in brief, and 100 fresh rollouts of each policy.

    dance-train --ref groove_dancer.npz -o runs/dancer0 --seed 0     # as many as wanted
    python benchmarks/learning.py runs/dancer0 runs/dancer1 runs/dancer2 runs/g1

Steps and minutes are those of training and of the evaluations within it. Last result in learning.md.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

from tracking import TaskConfig, evaluate, evaluation_task, load_bundle
from tracking.training import CHECKPOINT, CURVES, load_checkpoint

GATE = 0.95


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="+")
    parser.add_argument("--rollouts", type=int, default=100)
    args = parser.parse_args()
    print(
        "| run | robot | seed | steps | minutes | first at 95 % | finished of 100, and never 0.5 m off | survived s | "
        "body error mm |\n|---|---|---|---|---|---|---|---|---|"
    )
    for folder in args.runs:
        with open(folder / CURVES) as table:
            curve = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(table)]
        config = json.loads(load_checkpoint(folder / CHECKPOINT)["config"])
        bundle = load_bundle(folder)
        result = evaluate(
            bundle.runner,
            bundle.robot,
            bundle.reference,
            evaluation_task(TaskConfig()),
            rollouts=args.rollouts,
            seed=7,
        )
        there = next((f"{r['steps'] / 1e6:.1f} M, {r['minutes']:.0f} min" for r in curve if r["finished"] >= GATE), "-")
        print(
            f"| {folder.name} | {bundle.robot.name} | {config['seed']} | {curve[-1]['steps'] / 1e6:.1f} M | "
            f"{curve[-1]['minutes']:.0f} | {there} | {100 * result.finished:.0f} ({100 * result.finished_low:.0f} to "
            f"{100 * result.finished_high:.0f}), {100 * result.finished_in_place:.0f} | {result.survived_s:.2f} of "
            f"{result.duration_s:.2f} | {result.body_error_mm:.0f} |",
            flush=True,
        )
        for row in curve:
            print(
                f"    {folder.name}: {row['steps'] / 1e6:.1f} M, {row['minutes']:.1f} min: {row['survived_s']:.2f} s, "
                f"{100 * row['finished']:.0f} %, {row['body_error_mm']:.0f} mm"
            )


if __name__ == "__main__":
    main()
