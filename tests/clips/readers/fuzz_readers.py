"""Coverage-guided fuzzing of the readers: `python tests/clips/readers/fuzz_readers.py SEEDS.../ -max_total_time=600`.

Arguments are libFuzzer's: folders of seeds first (new finds are kept in the first), then flags. A traceback that is no
refusal, ten seconds without an answer, or over a gigabyte of memory ends the run and leaves the input as crash-*.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["clips"]):
    from clips import ReadOptions, read_clip
from robot_models import DanceError, load_robot

SUFFIX = os.environ.get("FUZZ_SUFFIX", "")  # readers go by content; an AMC wants its skeleton beside it
FOLDER = Path(tempfile.mkdtemp(dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
OPTIONS = ReadOptions(fps=30.0, skeleton=os.environ.get("FUZZ_SKELETON"))


def one(data: bytes) -> None:
    """Read one input; a refusal is as good as a clip."""
    path = FOLDER / f"x{SUFFIX}"
    path.write_bytes(data)
    with contextlib.suppress(DanceError):
        read_clip(path, OPTIONS)


if __name__ == "__main__":
    load_robot("dancer"), load_robot("g1")
    atheris.Setup([*sys.argv, "-timeout=10", "-rss_limit_mb=2500", "-malloc_limit_mb=1200"], one)
    atheris.Fuzz()
