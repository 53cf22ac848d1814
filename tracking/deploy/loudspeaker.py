"""The process that plays a song: python -m tracking.deploy.loudspeaker SONG AT LATE SINK; `song.py` starts it."""

from __future__ import annotations

import select
import sys
import time
from pathlib import Path
from typing import Any

from numpy import ndarray

_BLOCK_S = 0.02


def main(song: str, at: str, late: str, sink: str) -> None:
    """Read, open, wait for a word, play."""
    import soundfile

    samples, rate = soundfile.read(song, dtype="float32", always_2d=True)
    speaker: Any
    if sink:
        speaker, own = _Sink(Path(sink)), 0.0
    else:
        import sounddevice

        speaker = sounddevice.OutputStream(samplerate=rate, channels=samples.shape[1], latency="low")
        speaker.start()
        own = float(speaker.latency)
    ahead = float(late) if late else own
    _tell(f"ready {ahead:.4f}")
    place, due = len(samples), 0.0
    while True:
        playing = place < len(samples)
        heard = select.select([sys.stdin], [], [], 0.0 if playing else 0.2)[0]
        if heard:
            word = sys.stdin.readline()
            if not word:
                return
            # Below 0 seconds of the song have passed already; above, it waits.
            due = time.monotonic() + float(at) - ahead
            place = max(0, round(-(due - time.monotonic()) * rate)) if word.startswith("go") else len(samples)
        elif playing and time.monotonic() >= due:
            block = samples[place : place + round(_BLOCK_S * rate)]
            speaker.write(block)
            place += len(block)
        elif playing:
            time.sleep(min(0.001, max(0.0, due - time.monotonic())))


def _tell(line: str) -> None:
    """To who started the process."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


class _Sink:
    """A loudspeaker that keeps when it was given what, and takes as long as one."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def write(self, block: ndarray) -> None:
        """Take a block."""
        with self._path.open("a") as stream:
            stream.write(f"{time.monotonic():.6f} {float(abs(block).max()):.4f}\n")
        time.sleep(_BLOCK_S)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except KeyboardInterrupt:
        pass
    except Exception as e:  # whatever a sound system raises is told to who asked
        _tell(f"{type(e).__name__}: {e}")
