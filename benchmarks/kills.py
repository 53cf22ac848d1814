"""`kill -9` at any moment: what do the commands leave behind?

    python benchmarks/kills.py --count 100 --out benchmarks/kills.md

Half of the kills come at a random moment of a command's life, half at the moment when a file in the making appears beside
its place (the window in which a careless program would leave a half one). Afterwards every output must be absent or whole:
it is read again by the reader that users have. A training must have a checkpoint that loads and goes on.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
GROOVE = ROOT / "clips" / "samples" / "groove.csv"
RETARGET, TRAIN, EXPORT = "cli.retarget", "cli.train", "cli.export"


@dataclass(frozen=True)
class Victim:
    """One command: its module and words, and what its outputs have to be."""

    module: str
    words: Callable[[Path, Path], list[str]]  # of the folder for outputs, and of one with inputs
    check: Callable[[Path], str]  # what is wrong with the outputs, or nothing
    longest: float  # of a random kill [s]


def _npz(folder: Path) -> str:
    from clips import load_reference

    for path in folder.glob("[!.]*.npz"):
        load_reference(path)
    for path in folder.glob("[!.]*.rrd"):
        if path.read_bytes()[:4] != b"RRF2":
            return f"{path.name} is no recording"
    return ""


def _batch(folder: Path) -> str:
    import pandas as pd

    for path in folder.glob("[!.]*.json"):
        json.loads(path.read_text())
    for path in folder.glob("[!.]*.csv"):
        pd.read_csv(path)
    return _npz(folder)


def _motion(folder: Path) -> str:
    from clips import ReadOptions, read_clip

    for path in folder.glob("[!.]*.csv"):
        if read_clip(path, ReadOptions(source_robot="dancer", fps=30.0)).frames < 100:
            return f"{path.name} is short"
    return ""


def _run(folder: Path) -> str:
    from tracking.training import load_checkpoint

    if (folder / "checkpoint.pt").exists():
        load_checkpoint(folder / "checkpoint.pt")
    if (folder / "curves.csv").exists():
        import pandas as pd

        pd.read_csv(folder / "curves.csv")
    return ""


def _bundle(folder: Path) -> str:
    from tracking import load_bundle

    if (folder / "bundle").exists():
        load_bundle(folder / "bundle")
        if not (folder / "bundle" / "deploy.yaml").exists():
            return "a bundle without deploy.yaml"
    return ""


def _rehearsal(folder: Path) -> str:
    for path in folder.glob("[!.]*.json"):
        json.loads(path.read_text())
    return ""


VICTIMS = {
    "retarget": Victim("cli.retarget", lambda out, _: [str(GROOVE), "--end", "3", "-o", str(out / "a.npz")], _npz, 4.0),
    "batch": Victim("cli.retarget", lambda out, ins: [str(ins / "clips"), "-o", str(out), "--jobs", "2"], _batch, 12.0),
    "convert": Victim(
        "cli.convert",
        lambda out, ins: [str(ins / "a.npz"), "--to", "unitree-csv", "-o", str(out / "a.csv")],
        _motion,
        2.0,
    ),
    "train": Victim(
        "cli.train",
        lambda out, ins: ["--ref", str(ins / "a.npz"), "--teacher", "none", "-o", str(out), "--envs", "32"],
        _run,
        15.0,
    ),
    "export": Victim("cli.export", lambda out, _: ["groove-dancer", "-o", str(out / "bundle")], _bundle, 4.0),
    "deploy": Victim(
        "cli.deploy", lambda out, _: ["groove-g1", "--rehearse", "--json", str(out / "r.json")], _rehearsal, 24.0
    ),
}


def trial(victim: Victim, ins: Path, after: float | None) -> Counter[str]:
    """Start, kill, look; `after` None: as soon as a file in the making is there."""
    out = Path(tempfile.mkdtemp())
    script = f"import sys, {victim.module} as m; sys.exit(m.main({victim.words(out, ins)!r}))"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": ROOT}
    child = subprocess.Popen([sys.executable, "-c", script], **quiet, start_new_session=True)
    began, seen = time.monotonic(), Counter[str]()
    while child.poll() is None:
        making = any(p.name.startswith(".") and p.name != ".lock" for p in out.iterdir())
        if (after is None and making) or (after is not None and time.monotonic() - began > after):
            child.send_signal(signal.SIGKILL)
            seen["in flight"] += 1
            break
        if time.monotonic() - began > 60.0:
            child.kill()
        time.sleep(0.0 if after is None else 0.002)
    child.wait()
    time.sleep(0.3)
    with_parts = [p for p in out.iterdir() if p.name.startswith(".") and p.name != ".lock"]
    seen["a file in the making was cut off"] += bool(with_parts)
    try:
        wrong = victim.check(out)
    except Exception as e:  # whatever a reader stumbles over is a half file
        wrong = f"{type(e).__name__}: {e}"
    seen["partial"] += bool(wrong)
    if wrong:
        sys.stderr.write(f"{victim.module}: {wrong}\n")
    seen["processes left after 6 s"] += _left(child.pid)
    shutil.rmtree(out, ignore_errors=True)
    return seen


def _left(group: int) -> bool:
    """Whether processes of a group are still there after six seconds: a rehearsal's robot writes its log for three."""
    until = time.monotonic() + 6.0
    with contextlib.suppress(ProcessLookupError):
        while time.monotonic() < until:
            os.killpg(group, 0)
            time.sleep(0.05)
        os.killpg(group, signal.SIGKILL)
        return True
    return False


def main() -> int:
    """Every command so often; 1 where anything partial was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--only", nargs="*", default=list(VICTIMS))
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    rng, names = (
        random.Random(0),
        ("in flight", "a file in the making was cut off", "processes left after 6 s", "partial"),
    )
    ins = Path(tempfile.mkdtemp())
    (ins / "clips").mkdir()
    for k in range(3):
        shutil.copy(GROOVE, ins / "clips" / f"c{k}.csv")
    subprocess.run(
        [sys.executable, "-c", f"import cli.retarget as m; m.main([{str(GROOVE)!r}, '-o', {str(ins / 'a.npz')!r}])"],
        check=True, capture_output=True, cwd=ROOT,
    )  # fmt: skip
    lines = [f"| command | kills | {' | '.join(names)} |", "|---|" + "---|" * (1 + len(names))]
    partial = 0
    for name in args.only:
        seen = Counter[str]()
        for k in range(args.count):
            seen += trial(VICTIMS[name], ins, None if k % 2 else rng.uniform(0.0, VICTIMS[name].longest))
        partial += seen["partial"]
        lines.append(f"| {name} | {args.count} | {' | '.join(str(seen[n]) for n in names)} |")
        sys.stdout.write(lines[-1] + "\n")
        sys.stdout.flush()
    if args.out:
        head = f"# What kill -9 leaves behind\n\n`python benchmarks/kills.py --count {args.count}`\n\n"
        args.out.write_text(head + "\n".join(lines) + "\n")
    return int(partial > 0)


if __name__ == "__main__":
    sys.exit(main())
