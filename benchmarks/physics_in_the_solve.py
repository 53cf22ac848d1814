"""What physics in the solve does: every recording on every robot, solved without it and with it, judged by Pinocchio.

    python benchmarks/physics_in_the_solve.py FILE [FILE ...] [--robots g1,dancer] [--seconds 20]

A file that does not say its rate is given with it: `dance.csv@60`. The judge is the report (docs/report.md): frames that physics
does not allow, the 99th percentile of joint torque as a share of the motors', the deepest self-collision, limbs against the
person, jerk. "x real time" is the seconds of dance per processor second of the whole call. Last result: physics_in_the_solve.md.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

from clips import Clip, ClipError, MetricKey, ReadOptions, cut, read_clip, repair
from retarget import RetargetConfig, Retargeted, retarget
from robot_models import RobotModel, load_robot

TOLD = {
    MetricKey.IMPOSSIBLE_FRAMES: "impossible %",
    MetricKey.TORQUE_SHARE: "torque p99",
    MetricKey.SELF_COLLISION: "self mm",
    MetricKey.LIMB_DIRECTION_ERROR: "limbs °",
    MetricKey.JERK_P95: "jerk",
}
CONFIG = RetargetConfig()
PHYSICS = CONFIG.whole_clip.physics
WITHOUT = replace(CONFIG, whole_clip=replace(CONFIG.whole_clip, physics=replace(PHYSICS, weight=0.0)))


def main() -> None:
    """A row for each recording and robot, the means at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--robots", default="g1,dancer")
    parser.add_argument("--seconds", type=float, default=20.0)
    args = parser.parse_args()
    print(f"| recording, robot | {' | '.join(TOLD.values())} | x real time |\n|{'---|' * (2 + len(TOLD))}")
    impossible: list[tuple[float, float]] = []
    for file in args.files:
        try:
            clip = read(file, args.seconds)
        except ClipError as e:
            print(f"| {Path(file).name} | refused: {e.found} |", flush=True)
            continue
        for name in args.robots.split(","):
            row = compare(Path(file).name, clip, load_robot(name))
            impossible.append(row)
    count = len(impossible)
    for k, which in enumerate(("without", "with")):
        values = [pair[k] for pair in impossible]
        few = sum(value <= 1.0 for value in values)
        print(
            f"\n{which} physics: {sum(values) / count:.1f} % of the frames cannot be, at most 1 % in {few} of {count}"
        )


def read(file: str, seconds: float) -> Clip:
    """The first seconds of a recording; `file@60` states its rate."""
    path, _, fps = file.partition("@")
    clip = repair(read_clip(Path(path), ReadOptions(fps=float(fps) if fps else None)))
    return cut(clip, 0.0, seconds)


def compare(name: str, clip: Clip, robot: RobotModel) -> tuple[float, float]:
    """Print a row; the impossible frames without and with."""
    before, slow = timed(clip, robot, WITHOUT)
    after, fast = timed(clip, robot, CONFIG)
    one, two = ({m.key: m.value for m in r.report.metrics} for r in (before, after))
    cells = " | ".join(f"{one[key]:.3g} → {two[key]:.3g}" for key in TOLD)
    print(f"| {name}, {robot.name} | {cells} | {slow:.0f} → {fast:.0f} |", flush=True)
    return one[MetricKey.IMPOSSIBLE_FRAMES], two[MetricKey.IMPOSSIBLE_FRAMES]


def timed(clip: Clip, robot: RobotModel, config: RetargetConfig) -> tuple[Retargeted, float]:
    began = time.process_time()
    result = retarget(clip, robot, config)
    return result, result.reference.duration_s / (time.process_time() - began)


if __name__ == "__main__":
    main()
