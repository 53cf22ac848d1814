"""Damage files at every door for some minutes: `python tests/fuzzing/run.py --minutes 1 [--only reference] [--out FILE.md]`.

Each case is a seed with a few damages, made again by its number. What counts as found: a traceback that is no refusal, ten
seconds without an answer, two gigabytes of memory, a crash. Every find is kept as a file. A door's cases run in a process of
its own, which is begun anew where it dies. (The clip readers are also fuzzed by coverage: tests/clips/readers/fuzz_readers.py.)
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from multiprocessing.connection import Connection
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import mutate

SECONDS, MEMORY = 10.0, 2 << 30


class TooLongError(BaseException):
    """No answer in time."""


def work(name: str, first: int, until: float, talk: Connection) -> None:
    """Cases of one door from a number on, until a time; tells (number, find) now and then, and each number before its case."""
    import doors

    from robot_models import DanceError

    def late(*_: object) -> None:
        raise TooLongError

    warnings.simplefilter("ignore")
    os.chdir(FOLDER)  # MuJoCo leaves a log where it stands
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    door = doors.doors()[name]
    for seed in door.seeds:  # warm, and a control: the undamaged pass
        take(door, seed)
    signal.signal(signal.SIGALRM, late)
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
    resource.setrlimit(resource.RLIMIT_AS, (used + (4 << 30), used + (4 << 30)))
    case = first
    while time.monotonic() < until:
        data = made(name, case, door.seeds)
        if case % 50 == 0:
            talk.send(("case", case, ""))
        find = ""
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
        try:
            take(door, data)
        except DanceError:
            pass
        except TooLongError:
            find = f"no answer in {SECONDS:g} s"
        except BaseException as e:
            where = traceback.extract_tb(e.__traceback__)[-1]
            find = f"{type(e).__name__}: {str(e)[:120]} at {Path(where.filename).name}:{where.lineno}"
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        if resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10 > used + MEMORY:
            find, used = find or "over two gigabytes", used + MEMORY
        if find:
            talk.send(("find", case, find))
        case += 1
    talk.send(("end", case, ""))


def take(door: object, data: bytes) -> None:
    """Hand a file to a door."""
    path = FOLDER / f"x{door.suffix}"
    path.write_bytes(data)
    with contextlib.redirect_stderr(None):
        door.take(path)


def made(name: str, case: int, seeds: tuple[bytes, ...]) -> bytes:
    """The bytes of a case."""
    rng = random.Random((zlib.crc32(name.encode()) << 40) + case)
    return mutate.mutated(rng.choice(seeds), rng)


FOLDER = Path(tempfile.mkdtemp(dir="/dev/shm" if Path("/dev/shm").is_dir() else None))


def fuzz(name: str, seconds: float, first: int, keep: Path) -> tuple[int, dict[str, int]]:
    """Cases run at a door and what they found: the first case of each kind."""
    import doors

    until, case, found = time.monotonic() + seconds, first, dict[str, int]()
    while time.monotonic() < until - 0.5:
        ours, its = multiprocessing.Pipe()
        process = multiprocessing.get_context("fork").Process(target=work, args=(name, case, until, its), daemon=True)
        process.start()
        its.close()
        heard, silent = case, time.monotonic()
        while process.is_alive() or ours.poll():
            if ours.poll(1.0):
                try:
                    kind, at, find = ours.recv()
                except EOFError:
                    break
                silent = time.monotonic()
                heard = case = at
                if kind == "find":
                    found.setdefault(find, at)
                    case += 1
            elif time.monotonic() - silent > 10 * SECONDS:
                process.kill()
        process.join(5.0)
        if process.exitcode:
            found.setdefault(
                f"the process ended with {process.exitcode}, between cases {heard} and {heard + 50}", heard
            )
            case = heard + 50
    for find, at in found.items():
        keep.mkdir(parents=True, exist_ok=True)
        door = doors.doors()[name]
        (keep / f"{name}-{at}{door.suffix}").write_bytes(made(name, at, door.seeds))
        (keep / f"{name}-{at}.txt").write_text(find + "\n")
    return case - first, found


def main() -> int:
    """Every door in turn; 1 where something was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="of all doors together")
    parser.add_argument("--only", nargs="*", default=[], help="names of doors")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--keep", type=Path, default=Path("out/fuzzing"), help="where finds go")
    parser.add_argument("--out", type=Path, help="append a table here")
    args = parser.parse_args()
    import doors

    names = args.only or list(doors.doors())
    lines, any_found = ["| door | cases | a second | found |", "|---|---|---|---|"], False
    for name in names:
        seconds = 60.0 * args.minutes / len(names)
        cases, found = fuzz(name, seconds, args.first, args.keep)
        any_found = any_found or bool(found)
        said = "; ".join(f"{at}: {find}" for find, at in found.items()) or "nothing"
        lines.append(f"| {name} | {cases} | {cases / seconds:.0f} | {said} |")
        sys.stdout.write(lines[-1] + "\n")
        sys.stdout.flush()
    if args.out:
        with open(args.out, "a") as stream:
            stream.write(f"\nFrom case {args.first}:\n\n" + "\n".join(lines) + "\n")
    return int(any_found)


if __name__ == "__main__":
    sys.exit(main())
