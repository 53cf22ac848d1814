"""A song beside a dance on a robot: played by a process of its own, so that the control loop never waits for sound.

The process is started, reads the song and opens the loudspeaker before the robot moves; when the dance begins it hears a
single word. What the loudspeaker itself is late by is what its driver says, or what is stated.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
from pathlib import Path
from types import TracebackType

from tracking.errors import TrackingError

_PATIENCE_S = 20.0


def _cure(told: str) -> str:
    """What helps against what the process said."""
    if told.startswith("PortAudioError"):
        return "this machine has no loudspeaker: dance without the song, or play it elsewhere"
    if told.startswith("LibsndfileError"):
        return "give it a WAV, FLAC, OGG or MP3"
    return "pip install sounddevice soundfile; on Linux also the system's libportaudio2"


class SongPlayer:
    """A song that waits for its word.

    Args:
        song: a WAV, FLAC, OGG or MP3.
        at_s: second after the word at which it begins; below 0, so much of it is skipped.
        late_s: what the loudspeaker is late by [s]; None: what its driver says.
        sink: for tests, a file that takes the moments at which sound would be heard, instead of a loudspeaker.
    """

    def __init__(self, song: Path, at_s: float, late_s: float | None = None, sink: Path | None = None) -> None:
        words = [str(song), repr(at_s), "" if late_s is None else repr(late_s), "" if sink is None else str(sink)]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tracking.deploy.loudspeaker", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            bufsize=1, start_new_session=True,
        )  # fmt: skip
        assert self._process.stdout is not None
        told = self._process.stdout.readline().strip()
        if not told.startswith("ready"):
            self.close()
            raise TrackingError(
                f"song {song}", found=told or "no loudspeaker", expected="a song and a sound device",
                cure=_cure(told),
            )  # fmt: skip
        self.late_s = float(told.split()[1])  # of the loudspeaker

    def begin(self) -> None:
        """The dance begins now."""
        self._say("go")

    def end(self) -> None:
        """Silence."""
        self._say("stop")

    def _say(self, word: str) -> None:
        try:
            assert self._process.stdin is not None
            self._process.stdin.write(f"{word}\n")
            self._process.stdin.flush()
        except OSError:
            pass  # a song that is gone stops no dance

    def close(self) -> None:
        """End the process."""
        for stream in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):  # what was not read any more
                if stream is not None:
                    stream.close()
        self._process.terminate()
        self._process.wait(_PATIENCE_S)

    def __enter__(self) -> SongPlayer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
