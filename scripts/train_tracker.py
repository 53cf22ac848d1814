"""Train a robot's teacher on a folder of references: python scripts/train_tracker.py FOLDER --ref DATA --kept-out NAME ...

Goes on where FOLDER/teacher.pt stands, judges on references that it does not learn from, keeps a table. Nice to run in the
background: one core, and it can be stopped and started at any time.
"""

from __future__ import annotations

import argparse
import csv
import time
from contextlib import closing
from pathlib import Path

import numpy as np

from clips import MetricKey, is_reference
from robot_models import RobotModel, load_robot
from tracking import DistillationConfig, TeacherConfig, TrainConfig
from tracking.evaluation import Standing
from tracking.task import NamedReference, read_named_reference, read_rehearsal_set, write_rehearsal_set
from tracking.teaching import (
    TeacherTrainer,
    judge_teacher,
    load_teacher,
    restore_teacher,
    save_teacher,
    teach_tracker,
    teaching_task,
)

MOST_IMPOSSIBLE = 30.0  # per cent of frames that physics does not allow, beyond which a reference teaches nothing


def main() -> None:
    """Read, train until told to stop, judge and save on the way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--robot", default="g1")
    parser.add_argument(
        "--ref", type=Path, nargs="+", required=True, help="folders of references, references, rehearsal sets"
    )
    parser.add_argument("--kept-out", nargs="*", default=[], help="names that are judged on and not learnt from")
    parser.add_argument("--judge", type=Path, nargs="*", default=[], help="further references to judge on")
    parser.add_argument("--hours", type=float, default=1e9)
    parser.add_argument("--every", type=int, default=1_000_000, help="control steps between judgements")
    parser.add_argument(
        "--pupil", type=int, default=0, help="no training: so many labels of the teacher's, for FOLDER/tracker"
    )
    parser.add_argument("--rehearsal", action="store_true", help="no training: write FOLDER/rehearsal.npz")
    parser.add_argument("--credits", default="", help="whose motions they are, for the rehearsal set")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    robot, config, file = load_robot(args.robot), TeacherConfig(), args.folder / "teacher.pt"
    learnt, kept = _references(args.ref, args.kept_out, robot)
    kept += [read_named_reference(p) for p in args.judge]
    if args.rehearsal:
        write_rehearsal_set(args.folder / "rehearsal.npz", learnt, args.credits)
        return
    if args.pupil:
        lessons = TrainConfig(threads=1, distillation=DistillationConfig(samples=args.pupil))
        teach_tracker(file, robot, learnt, args.folder / "tracker", lessons, progress=_told_now_and_then)
        return
    task = teaching_task(robot, [p.reference for p in learnt], config, seed=int(time.time()) % 10_000)
    with closing(task):
        trainer, steps = TeacherTrainer(task, config, 0), 0
        if file.exists():
            teacher = load_teacher(file)
            restore_teacher(trainer, teacher)
            steps = teacher.steps
        minutes = sum(p.reference.duration_s for p in learnt) / 60.0
        print(f"{len(learnt)} references, {minutes:.1f} min; {len(kept)} kept out; at {steps} steps", flush=True)
        began, before, failed, since = time.time(), steps, 0, steps
        while time.time() - began < 3600.0 * args.hours:
            result = trainer.iterate_at(steps)
            steps += result.steps
            failed += sum(result.causes.values())
            if steps // args.every > (steps - result.steps) // args.every:
                save_teacher(file, trainer, steps)
                rate = (steps - before) / (time.time() - began)
                row = {"steps": steps, "failures_per_s": failed / ((steps - since) * task.dt), "steps_per_s": rate}
                some = learnt[:: max(1, len(learnt) // 12)]
                row |= _told("learnt", judge_teacher(trainer.actor, robot, some)) | _told(
                    "kept", judge_teacher(trainer.actor, robot, kept)
                )
                _append(args.folder / "curve.csv", row)
                failed, since = 0, steps


def _references(
    paths: list[Path], kept_out: list[str], robot: RobotModel
) -> tuple[list[NamedReference], list[NamedReference]]:
    files = [f for p in paths for f in (sorted(p.glob("*.npz")) if p.is_dir() else [p])]
    learnt: list[NamedReference] = []
    kept: list[NamedReference] = []
    for piece in (piece for file in files for piece in _pieces(file, robot)):
        impossible = piece.reference.report.get(MetricKey.IMPOSSIBLE_FRAMES, {"value": 0.0})["value"]
        if impossible > MOST_IMPOSSIBLE:
            print(f"left out: {piece.name}, {impossible:.0f} % of its frames are impossible")
            continue
        (kept if any(name in piece.name for name in kept_out) else learnt).append(piece)
    return learnt, kept


def _pieces(file: Path, robot: RobotModel) -> list[NamedReference]:
    """One reference, or the many of a rehearsal set."""
    return [read_named_reference(file)] if is_reference(file) else read_rehearsal_set(file, robot)


def _told_now_and_then(stage: str, done: int, total: int, note: str = "") -> None:
    if done // 100_000 > (done - 6_144) // 100_000:
        print(f"{stage}: {done} of {total}, {note}", flush=True)


def _told(group: str, found: list[Standing]) -> dict[str, float]:
    told = {f"{group} stand": float(np.mean([s.stand for s in found]))}
    told[f"{group} seconds"] = float(np.mean([s.seconds for s in found]))
    if group == "kept":
        told |= {f"{s.name} {what}": getattr(s, what) for s in found for what in ("stand", "seconds")}
    return told


def _append(path: Path, row: dict[str, float]) -> None:
    new = not path.exists()
    with path.open("a", newline="") as stream:
        table = csv.DictWriter(stream, fieldnames=list(row))
        if new:
            table.writeheader()
        table.writerow({k: f"{v:.6g}" for k, v in row.items()})
    print("  ".join(f"{k} {v:.4g}" for k, v in row.items()), flush=True)


if __name__ == "__main__":
    main()
