"""Reading: frames per second by format, and what an hour costs in memory.

    python benchmarks/reading_speed.py [--minutes 60]

The sample dance (23 joints) and its robot twin (dancer, 28 joints) are repeated until the file is long. Seconds are the
best of three; memory is the peak of a process of its own beyond that of a short file, over the size of the file. Last
result in reading_speed.md.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import clips.samples
from clips import LAYOUTS, ReadOptions, cut, full_qpos, read_clip, write_motion
from retarget import retarget
from robot_models import load_robot

SAMPLE = Path(clips.samples.__path__[0]) / "groove.bvh"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.one:
        measure(args.one)
        return
    with tempfile.TemporaryDirectory() as folder:
        short, long = (make(Path(folder) / name, m) for name, m in (("short", 0.2), ("long", args.minutes)))
        print("| file | frames | MB | frames/s | MB/s | peak memory beyond a short file's, over the file's size |")
        print("|---|---|---|---|---|---|")
        for small, large in zip(short, long, strict=True):
            (_, _, base), (seconds, frames, peak) = run(small), run(large)
            size = large.stat().st_size / 1e6
            print(
                f"| {large.name} | {frames:.0f} | {size:.0f} | {frames / seconds:.0f} | {size / seconds:.0f} | "
                f"{peak - base:.0f} MB, {(peak - base) / size:.1f} x |",
                flush=True,
            )


def make(folder: Path, minutes: float) -> list[Path]:
    """A BVH, a headless CSV, a GMR pickle and a BeyondMimic archive of so many minutes."""
    folder.mkdir()
    lines = SAMPLE.read_text().splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    rows = [line for line in lines[head:] if line.strip()]
    dt = float(lines[head - 1].split()[-1])
    count = round(60.0 * minutes / dt)
    body = (rows + rows[::-1]) * (count // (2 * len(rows)) + 1)
    bvh = folder / "dance.bvh"
    bvh.write_text("\n".join([*lines[: head - 2], f"Frames: {count}", lines[head - 1], *body[:count]]) + "\n")
    robot = load_robot("dancer")
    from clips import RobotClip
    from robot_models.maths import rotation as rot

    reference = retarget(cut(read_clip(SAMPLE), 0.0, 4.0), robot).reference
    there = np.concatenate((reference.qpos, reference.qpos[::-1]))
    qpos = np.tile(there, (round(3000 * minutes) // len(there) + 1, 1))[: round(3000 * minutes)]
    clip = RobotClip(
        fps=50.0, robot="dancer", joint_names=robot.joint_names, root_pos=qpos[:, :3], root_quat=rot.normalise(qpos[:, 3:7]),
        joint_pos=qpos[:, 7:], source=read_clip(SAMPLE).source,
    )  # fmt: skip
    written = [bvh]
    for name in ("unitree-csv", "gmr", "mujoco-npz"):
        written.append(folder / f"{name}{LAYOUTS[name].suffix}")
        write_motion(written[-1], name, clip, robot)
    return written


def run(path: Path) -> tuple[float, float, float]:
    """Seconds, frames and peak memory [MB] of reading one file in a process of its own."""
    command = [sys.executable, __file__, "--one", str(path)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return float(told[0]), float(told[1]), float(told[2])


def measure(path: Path) -> None:
    options = ReadOptions(
        fps=30.0 if path.suffix == ".csv" else None, source_robot=None if path.suffix == ".bvh" else "dancer"
    )
    best = float("inf")
    for _ in range(3):
        began = time.perf_counter()
        clip = read_clip(path, options)
        best = min(best, time.perf_counter() - began)
    assert clip.frames > 0 and (path.suffix == ".bvh" or full_qpos(clip, load_robot("dancer")).shape[1] == 35)
    print(best, clip.frames, peak_memory())


def peak_memory() -> float:
    """Of this process since it began [MB]; `getrusage` would tell of the process that started it."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return float(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1e3


if __name__ == "__main__":
    main()
