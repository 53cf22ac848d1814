"""The curves of a run: a table for people and scripts, events for TensorBoard."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from clips import write_whole
from tracking.training.ppo import Iteration


def write_curves(path: Path, rows: Sequence[Mapping[str, float]]) -> None:
    """One row per evaluation, as csv."""
    text = io.StringIO()
    table = csv.DictWriter(text, fieldnames=list(rows[0]))
    table.writeheader()
    table.writerows({k: f"{v:.6g}" for k, v in row.items()} for row in rows)
    with write_whole(path) as stream:
        stream.write(text.getvalue().encode())


class TensorBoard:
    """Curves for `tensorboard --logdir`; None writes nothing."""

    def __init__(self, folder: Path | None) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._writer: Any = None if folder is None else SummaryWriter(str(folder))

    def iteration(self, steps: int, result: Iteration) -> None:
        """Rewards, losses and failures of one iteration."""
        scalars = {f"reward/{k}": v for k, v in result.terms.items()} | {
            f"loss/{k}": v for k, v in result.losses.items()
        }
        scalars |= {f"failures/{k}": float(v) for k, v in result.causes.items()}
        scalars |= {"episode/length_s": result.episode_s, "policy/std": result.std}
        scalars |= {"policy/learning_rate": result.rate, "policy/kl": result.kl}
        self.scalars(scalars, steps)

    def evaluation(self, steps: int, row: Mapping[str, float]) -> None:
        """What an evaluation came to."""
        self.scalars({f"evaluation/{name}": value for name, value in row.items()}, steps)

    def scalars(self, scalars: Mapping[str, float], steps: int) -> None:
        """Numbers by name, after so many steps."""
        if self._writer is not None:
            for name, value in scalars.items():
                self._writer.add_scalar(name, value, steps)

    def __enter__(self) -> TensorBoard:
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()
