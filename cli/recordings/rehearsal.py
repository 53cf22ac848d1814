"""The recording of a rehearsal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget.recordings import save_rehearsal
from robot_models import load_robot

if TYPE_CHECKING:
    from tracking.deploy import Rehearsed


def save_performance(path: Path, rehearsed: Rehearsed, numbers: Mapping[str, Any]) -> None:
    """The simulated robot of a rehearsal, with its curves and what the performance came to."""
    rows = "\n".join(f"| {name} | {value} |" for name, value in numbers.items())
    text = f"# Rehearsal\n| | |\n|---|---|\n{rows}"
    save_rehearsal(path, load_robot("g1"), rehearsed.qpos, 50.0, rehearsed.series, text)
