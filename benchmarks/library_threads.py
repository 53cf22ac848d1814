"""How long does retarget() take as a library, beside other work on every core? With BLAS threads as they come, and with one.

    python benchmarks/library_threads.py CLIP [--seconds 20] [--robot g1]

The function is called, not the command; each case in a fresh process, where the threads are settled when NumPy is
imported. The two should not differ. Last result in library_threads.md.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from contextlib import contextmanager

CALL = """
import sys, time
from clips import cut, read_clip, repair
from retarget import retarget
from robot_models import load_robot
clip, robot = repair(cut(read_clip(sys.argv[1]), 0.0, float(sys.argv[2]))), load_robot(sys.argv[3])
began = time.perf_counter()
retarget(clip, robot)
print(time.perf_counter() - began)
"""
BUSY = "while True: pass"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clip")
    parser.add_argument("--seconds", default="20")
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"| {cores} cores | threads as they come, s | one thread, s |\n|---|---|---|")
    for name, others in (("idle", 0), ("busy", cores)):
        with company(others):
            took = {blas: timed(args, blas) for blas in (None, "1")}
        print(f"| {name} | {' | '.join(f'{min(t):.2f} to {max(t):.2f}' for t in took.values())} |", flush=True)
        print(f"    ratio of medians {statistics.median(took[None]) / statistics.median(took['1']):.2f}")


@contextmanager
def company(count: int):  # type: ignore[no-untyped-def]
    others = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()


def timed(args: argparse.Namespace, threads: str | None) -> list[float]:
    env = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    env |= {} if threads is None else {"OPENBLAS_NUM_THREADS": threads}
    command = [sys.executable, "-c", CALL, args.clip, args.seconds, args.robot]
    return [
        float(subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout)
        for _ in range(args.runs)
    ]


if __name__ == "__main__":
    main()
