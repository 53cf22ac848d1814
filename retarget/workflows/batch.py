"""Many clips to many robots: one job per pair, each whole by itself, done ones left alone, bad ones no end of the rest."""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Literal

from clips import (
    MetricKey,
    ReadOptions,
    clip_stem,
    file_and_name,
    load_reference,
    metric_label,
    read_of_several,
    repair,
    save_reference,
    write_whole,
)
from clips.checks import doubts
from retarget.config import RetargetConfig
from retarget.dynamics import hardest_stretches
from retarget.errors import RetargetError
from retarget.pipeline import Retargeted, retarget
from robot_models import DanceError, __version__, load_robot

SUFFIXES = (".bvh", ".csv", ".pkl", ".npz", ".npy", ".amc", ".c3d", ".txt", ".motion",
            ".pt", ".trc", ".mvnx", ".glb", ".gltf", ".vmd")  # fmt: skip
_FORMAT = 5
Verdict = Literal["keep", "down-weight", "quarantine", "exclude"]


_WATCH_S = 0.5  # between two looks whether the parent is there [s]


@dataclass(frozen=True, kw_only=True)
class BatchConfig:
    """What every job of a batch shares."""

    reading: ReadOptions = field(default_factory=ReadOptions)
    retargeting: RetargetConfig = field(default_factory=RetargetConfig)
    strict: bool = False
    float32: bool = False
    hard_share: float = 10.0  # per cent of frames that physics does not allow, beyond which a clip is down-weighted


@dataclass(frozen=True, kw_only=True)
class Job:
    """One clip for one robot."""

    clip: Path
    robot: str
    out: Path  # the reference (.npz); its outcome stands beside it (.json)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a job. keep: inside every gate; quarantine: below one; exclude: refused, `message` says why."""

    clip: str
    robot: str
    key: str  # hash of everything that the result follows from
    verdict: Verdict
    reference: str = ""  # the file that was written
    made: str = ""  # hash of that file
    message: str = ""
    seconds: float = 0.0  # length of the reference
    took_s: float = 0.0
    metrics: dict[str, float] = field(default_factory=dict)
    failed: tuple[str, ...] = ()  # gates
    why: tuple[str, ...] = ()  # they do not hold: when, which parts, whose fault
    hardest: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()  # what the recording itself makes doubtful
    skipped: bool = False  # it was there already, made from the same


def jobs_for(clips: Sequence[Path], robots: Sequence[str], folder: Path) -> list[Job]:
    """Every clip for every robot; outputs named after both, and after the clip's way down where names repeat.

    Args:
        clips: the files.
        robots: catalogue keys or profile paths.
        folder: where the references go.

    Raises:
        RetargetError: two pairs would have one output.
    """
    stems = [clip_stem(c) for c in clips]
    top = Path(os.path.commonpath([c.resolve().parent for c in clips])) if clips else Path()
    jobs: dict[Path, Job] = {}
    for clip, stem in zip(clips, stems, strict=True):
        way = clip.resolve().relative_to(top)
        name = stem if stems.count(stem) == 1 else "_".join((*way.parent.parts, stem, clip.suffix[1:]))
        for robot in robots:
            job = Job(clip=clip, robot=robot, out=folder / f"{name}_{Path(robot).stem}.npz")
            if job.out in jobs:
                other = jobs[job.out]
                raise RetargetError(
                    str(job.out), found=f"{other.clip} on {other.robot} and {clip} on {robot}", expected="an output for each",
                    cure="rename one of them",
                )  # fmt: skip
            jobs[job.out] = job
    return list(jobs.values())


def motion_files(folder: Path, *, but: Path) -> list[Path]:
    """The files below a folder that may hold motion, by suffix, in order of name; no hidden ones, none below `but`."""
    found = (p for p in folder.rglob("[!.]*") if p.suffix.lower() in SUFFIXES and p.is_file())
    return sorted(p for p in found if not p.resolve().is_relative_to(but.resolve()))


def run_batch(jobs: Sequence[Job], config: BatchConfig, workers: int) -> Iterator[Outcome]:
    """Outcomes as they come, from so many processes; a process that dies costs its job alone, once more alone.

    Args:
        jobs: of one folder; no two share an output.
        config: what they share.
        workers: processes; 1 works in this one.
    """
    if workers <= 1:
        yield from (run_job(job, config) for job in jobs)
        return
    left = list(jobs)
    with _pool(workers) as pool:
        try:
            futures = {pool.submit(run_job, job, config): job for job in left}
            for future in as_completed(futures):
                outcome = _result(future)
                if outcome is not None:
                    left.remove(futures[future])
                    yield outcome
        except BaseException:  # whoever stops this process does not want others to go on with it
            pool.shutdown(wait=False, cancel_futures=True)
            for child in active_children():
                child.terminate()
            raise
    # A dead process takes the pool with it. What is left is tried again, each in a pool of its own.
    for job in left:
        with _pool(1) as pool:
            outcome = _result(pool.submit(run_job, job, config))
        yield outcome or lost(job, "its process was killed, twice")


def lost(job: Job, why: str) -> Outcome:
    """The outcome of a job that came to no reference."""
    return Outcome(clip=str(job.clip), robot=job.robot, key="", verdict="exclude", message=why)


def run_job(job: Job, config: BatchConfig) -> Outcome:
    """Retarget one clip, or find that it was done; the outcome is written beside the reference.

    A refusal is an outcome and no error.
    """
    began = time.perf_counter()
    try:
        key = _key(job, config)
        done = _earlier(job)
        if done is not None and done.made != _hash(job.out):
            return _by_hand(job)
        if done is not None and done.key == key:
            return replace(done, skipped=True)
        clip = repair(read_of_several(job.clip, config.reading), strict=config.strict)
        result = retarget(clip, load_robot(job.robot), config.retargeting)
        save_reference(result.reference, job.out, float32=config.float32)
        outcome = replace(_judged(job, key, result, config), doubts=tuple(map(str, doubts(clip))))
    except DanceError as e:
        outcome = _by_hand_or_lost(job, e)
    except Exception as e:  # a fault of ours: it shall be seen, and not cost the other clips
        why = f"a fault of this tool, {type(e).__name__}: {e}; retarget this clip by itself for the whole trace"
        outcome = lost(job, why)
    outcome = replace(outcome, took_s=round(time.perf_counter() - began, 3))
    if outcome.key:
        with write_whole(_note(job)) as stream:
            stream.write(json.dumps({"format": _FORMAT, **asdict(outcome)}, indent=1).encode())
    return outcome


def _judged(job: Job, key: str, result: Retargeted, config: BatchConfig) -> Outcome:
    metrics = {m.key: m.value for m in result.report.metrics}
    hard = metrics.get(MetricKey.IMPOSSIBLE_FRAMES, 0.0) > config.hard_share
    verdict: Verdict = "quarantine" if result.report.failures else "down-weight" if hard else "keep"
    return Outcome(
        clip=str(job.clip),
        robot=job.robot,
        key=key,
        verdict=verdict,
        reference=str(job.out),
        made=_hash(job.out),
        seconds=result.reference.duration_s,
        metrics={str(key): value for key, value in metrics.items()},
        failed=tuple(m.label for m in result.report.failures),
        why=tuple(map(str, result.diagnoses)),
        hardest=()
        if result.dynamics is None
        else tuple(map(str, hardest_stretches(result.dynamics, above=1.0, most=3))),
    )


def _key(job: Job, config: BatchConfig) -> str:
    """Hash of clip, robot, configuration and versions."""
    file, asked = file_and_name(job.clip)
    told = hashlib.sha256((file.read_bytes() if file.is_file() else b"") + asked.encode())
    told.update(load_robot(job.robot).hash.encode())
    told.update(json.dumps([_FORMAT, asdict(config), versions()], sort_keys=True, default=str).encode())
    return told.hexdigest()


def versions() -> dict[str, str]:
    """Of the packages that results follow from."""
    return {"dance-retarget": __version__, **{p: version(p) for p in ("numpy", "scipy", "mujoco")}}


def _earlier(job: Job) -> Outcome | None:
    """The outcome of an earlier run, with its reference in place."""
    if not (job.out.is_file() and _note(job).is_file()):
        return None
    try:
        told = json.loads(_note(job).read_text())
        if told.pop("format") != _FORMAT:
            return None
        return Outcome(**told | {k: tuple(told[k]) for k in ("failed", "why", "hardest", "doubts")})
    except (OSError, ValueError, KeyError, TypeError):  # a note of another version, or half a one: do it again
        return None


def _by_hand_or_lost(job: Job, why: DanceError) -> Outcome:
    """A clip that is refused, as for want of its rate, may have been brought to the robot by itself."""
    if not job.out.is_file() or _note(job).is_file():
        return lost(job, str(why))
    try:
        return _by_hand(job)
    except DanceError:
        return lost(job, str(why))


def _by_hand(job: Job) -> Outcome:
    """The outcome of a reference that somebody has put in the place of the batch's since: it is theirs, and stays."""
    reference = load_reference(job.out, load_robot(job.robot))
    return Outcome(
        clip=str(job.clip), robot=job.robot, key="", skipped=True, reference=str(job.out),
        verdict="quarantine" if reference.failed_gates else "keep",
        message="put there by hand since, and kept; delete it to have it made again",
        seconds=reference.duration_s, failed=reference.failed_gates,
        metrics={str(key): float(measured["value"]) for key, measured in reference.report.items()},
    )  # fmt: skip


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _note(job: Job) -> Path:
    return job.out.with_suffix(".json")


def _pool(workers: int) -> ProcessPoolExecutor:
    context = get_context("spawn")
    return ProcessPoolExecutor(max_workers=workers, mp_context=context, initializer=_end_with, initargs=(os.getpid(),))


def _end_with(parent: int) -> None:
    """Have this process end when its parent does, even by a kill."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _result(future: Future[Outcome]) -> Outcome | None:
    try:
        return future.result()
    except BrokenProcessPool:
        return None


def summary_rows(outcomes: Iterable[Outcome]) -> list[dict[str, object]]:
    """One flat row per job, for a table: the metrics are columns, by their titles."""
    rows = []
    for o in outcomes:
        row: dict[str, object] = {
            "clip": o.clip, "robot": o.robot, "verdict": o.verdict, "seconds": o.seconds, "took_s": o.took_s,
            "failed": "; ".join(o.failed), "why": "; ".join(o.why), "hardest": "; ".join(o.hardest),
            "doubts": "; ".join(o.doubts), "message": o.message,
        }  # fmt: skip
        rows.append(row | {metric_label(key): value for key, value in o.metrics.items()})
    return rows
