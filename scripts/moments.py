"""Moments of one dance side by side, as a recording for scripts/picture.py: how the README's first picture was made.

python scripts/moments.py dance_g1.npz moments.rrd --at 2.3 5.1 7.4
python scripts/picture.py moments.rrd docs/pictures/dance.png --size 1800x620
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from clips import load_reference
from retarget.recordings import save_moments
from robot_models import load_robot


def main() -> None:
    """Parse, cut the frames out, save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reference", type=Path)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--at", type=float, nargs="+", required=True, help="seconds of the reference")
    parser.add_argument("--apart", type=float, default=0.95, help="metres between two moments")
    args = parser.parse_args()
    reference = load_reference(args.reference)
    frames = np.round(np.array(args.at) * reference.fps).astype(int)
    save_moments(args.recording, load_robot(reference.robot), reference, frames, args.apart)


if __name__ == "__main__":
    main()
