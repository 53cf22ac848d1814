"""How a folder of clips scales: processes and Ray against one process, and the cost per clip as the folder grows.

    python benchmarks/batch_scaling.py FOLDER_OF_CLIPS [--most 40]

Every row retargets the same clips, cut to ten seconds so that none outweighs the rest, to `dancer` and `g1`; the time is
that of the whole batch, start-up of processes or cluster included.
"""

from __future__ import annotations

import argparse
import itertools
import os
import tempfile
import time
from pathlib import Path

from clips import ReadOptions, cut, read_clip, save_reference
from retarget import RetargetConfig, retarget
from retarget.workflows import BatchConfig, Job, jobs_for, run_batch, run_on_ray
from robot_models import DanceError, load_robot
from robot_models.maths import available_threads

CONFIG = BatchConfig(retargeting=RetargetConfig())


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--most", type=int, default=40, help="clips in the largest folder")
    args = arguments.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        clips = _short_clips(args.folder, Path(scratch), args.most)
        cores = available_threads()
        print(f"{len(clips)} clips of ten seconds, {cores} cores\n")
        print("| clips x robots | how | seconds | s per pair | speed-up | efficiency |\n|---|---|---|---|---|---|")
        sizes = [n for n in (5, 10, 20, 40, 80) if n <= len(clips)]
        for size in sizes:
            _row(clips[:size], Path(scratch), f"{cores} processes", lambda jobs: run_batch(jobs, CONFIG, cores))
        pairs = clips[: min(20, len(clips))]
        alone = _row(pairs, Path(scratch), "1 process", lambda jobs: run_batch(jobs, CONFIG, 1))
        _row(pairs, Path(scratch), f"{cores} processes", lambda jobs: run_batch(jobs, CONFIG, cores), alone, cores)
        _row(
            pairs,
            Path(scratch),
            f"Ray, {cores} cores here",
            lambda jobs: run_on_ray(jobs, CONFIG, "local"),
            alone,
            cores,
        )
        done = jobs_for(pairs, ["dancer", "g1"], Path(scratch))
        list(run_batch(done, CONFIG, cores))
        _row(pairs, Path(scratch), "1 process, all done before", lambda _: run_batch(done, CONFIG, 1))


def _short_clips(folder: Path, scratch: Path, most: int) -> list[Path]:
    """References of ten seconds, from everything readable in the folder, in turn, at different seconds."""
    os.makedirs(scratch / "clips")
    made: list[Path] = []
    sources = []
    for path in sorted(p for p in folder.rglob("*") if p.suffix in (".bvh", ".npz")):
        try:
            sources.append((path.stem, read_clip(path, ReadOptions())))
        except DanceError:
            continue
    robot = load_robot("g1")
    for k in itertools.count():
        fitting = [(name, clip) for name, clip in sources if clip.frames / clip.fps >= 10.0 * (k + 1)]
        if not fitting:
            return made
        for name, clip in fitting:
            if len(made) == most:
                return made
            part = cut(clip, 10.0 * k, 10.0 * (k + 1))
            try:
                result = retarget(part, robot, RetargetConfig(dynamics=False, lead_in_s=0.0, lead_out_s=0.0))
            except DanceError:
                continue
            made.append(scratch / "clips" / f"{name}_{k}.npz")
            save_reference(result.reference, made[-1])


def _row(clips: list[Path], scratch: Path, how: str, work, alone: float = 0.0, cores: int = 1) -> float:  # type: ignore[no-untyped-def]
    out = Path(tempfile.mkdtemp(dir=scratch))
    jobs: list[Job] = jobs_for(clips, ["dancer", "g1"], out)
    began = time.perf_counter()
    outcomes = list(work(jobs))
    took = time.perf_counter() - began
    assert len(outcomes) == len(jobs)
    assert all(o.verdict != "exclude" for o in outcomes), [o.message for o in outcomes if o.message]
    gain = f"{alone / took:.2f} | {100 * alone / took / cores:.0f} %" if alone else " | "
    print(f"| {len(clips)} x 2 | {how} | {took:.1f} | {took / len(jobs):.2f} | {gain} |", flush=True)
    return took


if __name__ == "__main__":
    main()
