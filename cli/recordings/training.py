"""The recording of a training run: its curves, and the policy beside the ghost of its reference."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.recordings import save_rollouts
from robot_models import RobotModel

if TYPE_CHECKING:
    from tracking.task import NamedReference
    from tracking.training import Run


def save_training(path: Path, robot: RobotModel, pieces: Sequence[NamedReference], result: Run) -> None:
    """The curves, and the policy beside its ghost: of several pieces in the one that finishes least often."""
    if not result.evaluations:
        return
    piece = min(pieces, key=lambda p: result.evaluations[p.name].finished)
    steps = np.array([row["steps"] for row in result.curves])
    names = {"survived_s": "survived [s]", "finished": "finished [share]", "body_error_mm": "body error [mm]"}
    curves = {label: (steps, np.array([row[key] for row in result.curves])) for key, label in names.items()}
    save_rollouts(path, robot, piece.reference, result.evaluations[piece.name].shown, curves, _text(result))


def _text(result: Run) -> str:
    rows = [
        f"| {r['steps'] / 1e6:.2f} M | {r['minutes']:.1f} | {r['survived_s']:.2f} | {100 * r['finished']:.0f} % | "
        f"{r['body_error_mm']:.0f} |"
        for r in result.curves
    ]
    return "\n".join(
        ["# Learning", "| steps | min | survived [s] | finished | body error [mm] |", "|---|---|---|---|---|", *rows]
    )
