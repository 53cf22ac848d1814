"""The recording of an evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.recordings import save_rollouts

if TYPE_CHECKING:
    from tracking import Bundle, Evaluation


def save_evaluation(
    path: Path, bundle: Bundle, results: Mapping[str, Evaluation], title: str, lines: Sequence[Sequence[str]]
) -> None:
    """The best, the median and a failed rollout in each engine, with a table of the numbers: `lines`, the header first."""
    header, *rows = (f"| {' | '.join(line)} |" for line in lines)
    text = "\n".join([f"# {title}", header, "|---" * len(lines[0]) + "|", *rows])
    shown = {
        label if len(results) == 1 else f"{engine}, {label}": rollout
        for engine, result in results.items()
        for label, rollout in result.shown.items()
    }
    save_rollouts(path, bundle.robot, bundle.reference, shown, {}, text)
