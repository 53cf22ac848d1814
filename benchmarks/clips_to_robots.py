"""What does the retargeter make of real clips? One line per clip and robot, the numbers of the report.

    python benchmarks/clips_to_robots.py FOLDER [--seconds 20]

FOLDER holds clips by format (csv/, pkl/, npz/, bvh/). Every clip goes to `dancer`, one of each format to every other robot
that is here. Last result stands in clips_to_robots.md.
"""

from __future__ import annotations

import argparse
import platform
import time
from pathlib import Path

from clips import Clip, MetricKey, ReadOptions, cut, read_clip
from retarget import retarget
from robot_models import DanceError, installed, load_robot, robot_names

COLUMNS = {
    MetricKey.POSITION_BEYOND_LIMITS: "over limits rad",
    MetricKey.SPEED_SHARE: "speed share",
    MetricKey.JERK_P95: "jerk p95",
    MetricKey.PENETRATION: "under floor mm",
    MetricKey.SELF_COLLISION: "self-coll. mm",
    MetricKey.CONTACT_SPEED: "touch cm/s",
    MetricKey.SLIDE_MEAN: "slide mm",
    MetricKey.SLIDE_WORST: "worst mm",
    MetricKey.AIRBORNE: "airborne %",
    MetricKey.AIRBORNE_SOURCE: "source %",
    MetricKey.LIMB_DIRECTION_ERROR: "limbs deg",
}
# Files that do not say their rate; it stands in their data set's card.
RATES = {
    "g1_gangnam_style_60hz.csv": 60.0,
    "g1moves_tiktok.csv": 60.0,
    "lafan1_g1_dance1_subject2.csv": 30.0,
    "lafan1_g1_dance2_subject1.csv": 30.0,
    "lafan1_g1_fallAndGetUp2_subject2.csv": 30.0,
}
FORMATS = ("csv", "pkl", "npz", "bvh")
# One clip of a person per format that holds people; robot formats give one clip of a robot.
ONE_EACH = (
    "g1moves_tiktok.csv",
    "twist2_yanjie_walk_001.pkl",
    "asap_smpl_apt_level1.npz",
    "lafan1_dance1_subject2.bvh",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each clip")
    args = parser.parse_args()
    files = [f for kind in FORMATS for f in sorted((args.folder / kind).glob(f"*.{kind}"))]
    samples = Path(__file__).parent.parent / "clips" / "samples"
    files += sorted(samples.glob("groove.*"))
    print(f"First {args.seconds:g} s of each clip; {platform.machine()}, one process.\n")
    print("| robot | clip | gates | frames/s |", " | ".join(COLUMNS.values()), "|")
    print("|" + "---|" * (4 + len(COLUMNS)))
    for robot in ("dancer", *(r for r in robot_names() if r != "dancer" and installed(r))):
        for file in files:
            if robot == "dancer" or file.name in ONE_EACH or file.parent == samples:
                print(row(robot, file, args.seconds), flush=True)


def row(robot_name: str, file: Path, seconds: float) -> str:
    robot = load_robot(robot_name)
    try:
        clip: Clip = cut(read_clip(file, ReadOptions(fps=RATES.get(file.name))), 0.0, seconds)
    except DanceError as e:
        return f"| {robot_name} | {file.name} | refused: {e} |"
    began = time.perf_counter()
    result = retarget(clip, robot)
    rate = result.reference.frames / (time.perf_counter() - began)
    values = {m.key: m.value for m in result.report.metrics}
    failed = ", ".join(COLUMNS.get(m.key, m.label) for m in result.report.failures)
    cells = [f"{values[n]:.3g}" for n in COLUMNS]
    return f"| {robot_name} | {file.name} | {failed or 'pass'} | {rate:.0f} | {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
