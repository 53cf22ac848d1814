"""How near dances land on the beats of a song: python benchmarks/music.py CLIP ... [--robot g1 dancer].

The song is made by `clips.samples.write_song`, 104 and then 112 beats a minute; librosa finds its beats, held against those
that it was made of. Each clip is brought to each robot at its recorded pace, begun where that fits best, and at the pace of the
song; what stands in the table is measured on the robot's own motion.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from clips import MetricKey, cut, read_clip
from clips.music import find_beats
from clips.samples import beats_of, write_song
from retarget import retarget_to_music
from robot_models import DanceError

TEMPI = ((104.0, 10), (112.0, 12))
COLUMNS = "clip | robot | on a beat, recorded | on a beat | median error, recorded | median error | p95 | gates missed | seconds"


def main() -> None:
    """Print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, nargs="+")
    parser.add_argument("--robot", nargs="+", default=["g1", "dancer"])
    parser.add_argument("--seconds", type=float, default=20.0)
    args = parser.parse_args()
    true = beats_of(*TEMPI)
    with tempfile.TemporaryDirectory() as folder:
        beats = find_beats(write_song(Path(folder) / "song.wav", true))
    off = 1e3 * np.abs(true[:, None] - beats.times_s).min(axis=1)
    print(f"{len(true)} beats: {(off < 40.0).sum()} found within 40 ms, median {np.median(off):.0f} ms off\n")
    print(f"| {COLUMNS} |\n|{'---|' * len(COLUMNS.split('|'))}")
    for path in args.clips:
        for robot in args.robot:
            began = time.perf_counter()
            try:
                report = retarget_to_music(cut(read_clip(path), 0.0, args.seconds), robot, beats).report
            except DanceError as e:
                print(f"| {path.name} | {robot} | {e.found} |")
                continue
            value = {m.key: m.value for m in report.metrics}
            told = [
                f"{value[MetricKey.ON_BEAT_RECORDED]:.0f} %", f"{value[MetricKey.ON_BEAT]:.0f} %",
                f"{value[MetricKey.BEAT_ERROR_RECORDED]:.0f} ms", f"{value[MetricKey.BEAT_ERROR]:.0f} ms",
                f"{value[MetricKey.BEAT_ERROR_P95]:.0f} ms", ", ".join(m.label for m in report.failures) or "none",
                f"{time.perf_counter() - began:.0f}",
            ]  # fmt: skip
            print(f"| {path.name} | {robot} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
