"""Do two commits give the same results? Hashes of references and of the first ten iterations of a training.

    python benchmarks/same_results.py CLIPS > before.txt     # on the one commit, CLIPS the folder of shared clips
    python benchmarks/same_results.py CLIPS > after.txt      # on the other
    diff before.txt after.txt

Only commands and files are used, so the script runs on any commit. A reference's hash is of its motion, contacts,
segments and the values of its report; a run's is of networks, normalisers, optimiser and curves. Last result in
same_results.md.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

SAMPLE = Path(__file__).parent.parent / "clips" / "samples" / "groove.bvh"
CLIPS = {  # file below CLIPS, what is stated about it
    "bvh/lafan1_dance1_subject2.bvh": ("--start", "5", "--end", "15"),
    "bvh/perfume_aachan.bvh": ("--end", "10"),
    "csv/g1_gangnam_style_60hz.csv": ("--fps", "60", "--end", "10"),
    "npz/asap_smpl_apt_level1.npz": (),
}
ROBOTS = ("dancer", "g1")
STEPS = 10 * 256 * 24  # iterations of environments of steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--no-training", dest="training", action="store_false")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for clip, stated in {SAMPLE: (), **{args.clips / name: words for name, words in CLIPS.items()}}.items():
            for robot in ROBOTS:
                out = Path(folder) / f"{clip.stem}_{robot}.npz"
                run("retarget", str(clip), "--robot", robot, "-o", str(out), "--no-recording", *stated)
                print(f"{reference_hash(out)}  {clip.name} on {robot}", flush=True)
        if args.training:
            ref, out = Path(folder) / f"{SAMPLE.stem}_dancer.npz", Path(folder) / "run"
            words = ("--ref", str(ref), "-o", str(out), "--steps", str(STEPS), "--threads", "1", "--seed", "0")
            run("train", *words, "--no-recording")
            print(f"{run_hash(out)}  ten iterations of {SAMPLE.name} on dancer")


def run(command: str, *words: str) -> None:
    """A command of this checkout; one below a gate has done its work too."""
    code = f"import sys; from cli.{command} import main; sys.exit(main())"
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    if done.returncode > 1:
        sys.exit(f"{command} {' '.join(words)}:\n{done.stderr}")


def reference_hash(path: Path) -> str:
    digest = hashlib.sha256()
    with np.load(path) as file:
        for name in sorted(set(file.files) - {"meta"}):
            digest.update(name.encode() + np.ascontiguousarray(file[name]).tobytes())
        report = json.loads(str(file["meta"]))["report"]
    digest.update(json.dumps(sorted(repr(measured["value"]) for measured in report.values())).encode())
    return digest.hexdigest()[:16]


def run_hash(folder: Path) -> str:
    import torch

    digest = hashlib.sha256()
    for tensor in tensors(torch.load(folder / "checkpoint.pt", weights_only=True)["algorithm"]):
        digest.update(np.ascontiguousarray(tensor.numpy()).tobytes())
    with open(folder / "curves.csv") as table:
        digest.update(repr([{k: v for k, v in r.items() if k != "minutes"} for r in csv.DictReader(table)]).encode())
    return digest.hexdigest()[:16]


def tensors(state: Any) -> list[Any]:
    """Every tensor in nested dictionaries and lists."""
    if isinstance(state, dict):
        return [t for key in sorted(state, key=str) for t in tensors(state[key])]
    if isinstance(state, list | tuple):
        return [t for value in state for t in tensors(value)]
    return [state] if hasattr(state, "numpy") else []


if __name__ == "__main__":
    main()
