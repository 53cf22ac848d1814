"""Does training learn within minutes? Time survived from the first evaluation to the last, over seeds.

    python benchmarks/learning.py REFERENCE.npz [--seeds 3] [--steps 500000]

Last result stands in learning.md.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from clips import load_reference
from robot_models import load_robot
from tracking import TrainConfig, train


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reference", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=500_000)
    args = parser.parse_args()
    robot = load_robot(load_reference(args.reference).robot)
    reference = load_reference(args.reference, robot)
    dance_s = (reference.dance.stop - 1 - reference.dance.start) * (1 / reference.fps)
    print(f"{args.reference.name} on {robot.name}: {dance_s:.2f} s; 256 environments, {args.steps} steps.\n")
    print("| seed | steps | minutes | survived s | finished % | body error mm |\n|---|---|---|---|---|---|")
    for seed in range(args.seeds):
        with tempfile.TemporaryDirectory() as folder:
            run = train(
                robot,
                reference,
                "benchmark",
                Path(folder),
                TrainConfig(steps=args.steps, evaluate_every=100_000, seed=seed),
            )
        for r in run.curves:
            print(
                f"| {seed} | {r['steps']:.0f} | {r['minutes']:.1f} | {r['survived_s']:.2f} | {100 * r['finished']:.0f} | "
                f"{r['body_error_mm']:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
