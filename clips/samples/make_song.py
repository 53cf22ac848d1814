"""Write a song that nobody plays: python -m clips.samples.make_song SONG.wav 104x8 112x10.

Eight bars at 104 beats a minute, ten at 112. Beside SONG.wav stands SONG.csv with its beats.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from clips.samples.song import beats_of, write_song


def main() -> None:
    """Write a song and its beats."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("song", type=Path)
    parser.add_argument("tempi", nargs="*", default=["104x8", "112x10"], help="beats a minute x bars of four")
    args = parser.parse_args()
    parts = [text.split("x") for text in args.tempi]
    beats = beats_of(*((float(bpm), int(bars)) for bpm, bars in parts))
    write_song(args.song, beats)
    np.savetxt(args.song.with_suffix(".csv"), beats, fmt="%.4f")


if __name__ == "__main__":
    main()
