"""What a run of learning has come to so far: its curves and evaluations, and whether there is a reason to stop."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from robot_models import RobotModel
from robot_models.maths import Progress, silent
from tracking.config import TrainConfig
from tracking.errors import TrackingError
from tracking.evaluation import Evaluation, evaluate, evaluation_task
from tracking.policy import Policy
from tracking.run_files import refuse_run_that_is_there
from tracking.task import NamedReference
from tracking.training.folder_lock import alone_in


@dataclass(kw_only=True)
class Run:
    """What a run has come to."""

    folder: Path
    steps: int = 0
    seconds: float = 0.0
    before_s: float = 0.0  # of these, before it was resumed
    focus_s: float = 0.0  # of these, in which a teacher learnt and steps did not count
    curves: list[dict[str, float]] = field(default_factory=list)  # one row per evaluation
    evaluations: dict[str, Evaluation] = field(default_factory=dict)  # the last, of every piece
    kept: dict[str, float] = field(default_factory=dict)  # the row of the policy that was kept, where not the last
    onnx_difference: float = math.nan
    stopped: str = ""
    begun: bool = False  # with a policy that dances something already
    saved: int = 0  # the step that a resumed run goes on from

    def evaluate(
        self,
        policy: Policy,
        robot: RobotModel,
        pieces: Sequence[NamedReference],
        config: TrainConfig,
        progress: Progress = silent,
    ) -> dict[str, float]:
        """Judge a policy on every piece, on robots that no earlier evaluation had; returns a row of curves."""
        each = max(min(config.fewest_rollouts, config.rollouts), config.rollouts // len(pieces))
        self.evaluations = {
            piece.name: evaluate(
                policy, robot, piece.reference, evaluation_task(config.task), rollouts=each,
                seed=config.seed + 1000 + len(self.curves), threads=config.threads, progress=progress,
            )
            for piece in pieces
        }  # fmt: skip
        row = {"steps": float(self.steps), "minutes": self.seconds / 60.0}
        # Of several dances the one that is finished least often: a run is over when it is.
        row["finished"] = min(e.finished for e in self.evaluations.values())
        row["stood"] = min(e.stood for e in self.evaluations.values())
        for name in ("survived_s", "stood_s", "body_error_mm", "global_error_mm"):
            row[name] = float(np.mean([getattr(e, name) for e in self.evaluations.values()]))
        if len(pieces) > 1:
            row |= {f"finished {name}": e.finished for name, e in self.evaluations.items()}
        return row

    @property
    def outcome(self) -> dict[str, float]:
        """The judgement of the policy that came of the run."""
        return self.kept or self.curves[-1]

    def reached(self, config: TrainConfig) -> bool:
        """Whether enough rollouts finished, twice in a row."""
        return len(self.curves) >= 2 and all(row["finished"] >= config.target for row in self.curves[-2:])

    def reason_to_stop(self, config: TrainConfig, steps: int) -> str:
        """Why there is no need to go on, "" where there is; `steps` is the budget."""
        if self.reached(config):
            return f"target reached: {100 * config.target:.0f} % of rollouts finish"
        if self.steps >= steps:
            return f"budget of {steps} steps used"
        if self.seconds - self.before_s >= 60.0 * config.minutes:
            return f"budget of {config.minutes:g} minutes used"
        return ""

    def comes_to(self, config: TrainConfig, steps: int) -> int:
        """The steps at which the run will end by its budgets: `steps`, or fewer where the minutes are used before."""
        if not self.steps or math.isinf(config.minutes):
            return steps
        pace = self.steps / max(self.seconds - self.focus_s, 1e-9)
        return max(self.steps, min(steps, round(pace * (self.before_s + 60.0 * config.minutes - self.focus_s))))


def nobody_looks(run: Run) -> None:
    """What is told of a judgement where nobody looks on."""


@contextmanager
def run_folder(folder: Path, resume: bool) -> Iterator[None]:
    """Make a run's folder, and hold it for as long as the block lasts.

    Raises:
        TrackingError: a run is already there, and shall not go on; another writes there now; or it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise TrackingError(str(folder), found=f"a folder that cannot be made ({e.strerror})", expected="one") from e
    with alone_in(folder):
        if not resume:
            refuse_run_that_is_there(folder)
        yield
