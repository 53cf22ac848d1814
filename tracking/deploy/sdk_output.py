"""The SDK talks on the process's standard output: kept aside, so that what it complains of can be counted."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from tracking.deploy.transport import CRC_COMPLAINT


@dataclass(frozen=True, kw_only=True)
class SdkOutput:
    """What was the standard output, and the file that took its place for the SDK."""

    people: TextIO
    file: Path

    def complaints(self) -> int:
        """Messages that the SDK dropped for their CRC, at both ends."""
        files = (self.file, *self.file.parent.glob("robot*.txt"))
        return sum(f.read_text(errors="replace").count(CRC_COMPLAINT) for f in files)


@contextlib.contextmanager
def sdk_output_aside(path: Path) -> Iterator[SdkOutput]:
    """Send the standard output of the process to a file, and give people another way to be spoken to."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(path, "wb") as file:
        os.dup2(file.fileno(), 1)
    try:
        with os.fdopen(os.dup(kept), "w") as people:
            yield SdkOutput(people=people, file=path)
    finally:
        os.dup2(kept, 1)
        os.close(kept)
