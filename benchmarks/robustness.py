"""How a policy stands what it was and was not trained for: one thing changed at a time, everything else nominal.

    python benchmarks/robustness.py runs/groove groove-g1

Every row: 100 rollouts of the whole dance with start and sensor noise. Last result in robustness.md.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from tracking import RandomisationConfig, evaluate, evaluation_task, load_bundle

NOMINAL = RandomisationConfig(
    friction=(1.0, 1.0),
    mass=(1.0, 1.0),
    torso_com=0.0,
    gains=(1.0, 1.0),
    encoder_bias=0.0,
    delay=(0.0, 0.0),
    pushes=False,
)
CONDITIONS = {
    "nominal": {},
    "delay 10 ms": {"delay": (0.010, 0.010)},
    "delay 20 ms": {"delay": (0.020, 0.020)},
    "delay 30 ms": {"delay": (0.030, 0.030)},
    "delay 40 ms": {"delay": (0.040, 0.040)},
    "mass 1.2": {"mass": (1.2, 1.2)},
    "friction 0.5": {"friction": (0.5, 0.5)},
    "friction 0.3": {"friction": (0.3, 0.3)},
    "gains 0.9 to 1.1": {"gains": (0.9, 1.1)},
    "encoder bias 0.02 rad": {"encoder_bias": 0.02},
    "torso CoM 5 cm": {"torso_com": 0.05},
    "pushes 0.5 m/s, 1 to 3 s": {"pushes": True, "push_linear": (0.5, 0.5, 0.2), "push_angular": (0.52, 0.52, 0.78)},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundles", type=Path, nargs="+")
    parser.add_argument("--rollouts", type=int, default=100)
    args = parser.parse_args()
    bundles = [load_bundle(path) for path in args.bundles]
    print("finished %, survived s, body error mm\n")
    print(f"| | {' | '.join(path.name for path in args.bundles)} |\n|---|{'---|' * len(bundles)}")
    for name, change in CONDITIONS.items():
        cells = []
        for bundle in bundles:
            pushes = bool(change.get("pushes"))
            task = evaluation_task(replace(bundle.config, randomisation=replace(NOMINAL, **change)))
            task = replace(task, randomisation=replace(task.randomisation, pushes=pushes))
            r = evaluate(bundle.runner, bundle.robot, bundle.reference, task, rollouts=args.rollouts, seed=11)
            cells.append(f"{100 * r.finished:.0f}, {r.survived_s:.1f}, {r.body_error_mm:.0f}")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
