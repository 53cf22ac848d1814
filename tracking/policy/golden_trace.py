"""A golden trace, `golden.npz`: what the trainer's own road made of some measurements, for a runner to repeat.

Nothing here needs a simulator or a trainer.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import write_whole
from robot_models.incoming import read_arrays
from tracking.errors import TrackingError
from tracking.policy.measurement import Measurement
from tracking.policy.runner import Runner

TOLERANCE = 1e-4  # of observations, actions and targets: float32 networks on another processor


@dataclass(frozen=True, kw_only=True, eq=False)
class Golden:
    """The first seconds of one robot's dance, from the motion's first dance frame. K control periods."""

    quat: Float[ndarray, "K 4"]
    gyro: Float[ndarray, "K 3"]
    joint_pos: Float[ndarray, "K J"]
    joint_vel: Float[ndarray, "K J"]
    observation: Float[ndarray, "K A"]
    action: Float[ndarray, "K J"]
    target: Float[ndarray, "K J"]


def write_golden(path: Path, golden: Golden) -> None:
    """Write the trace, whole or not at all."""
    with write_whole(path) as stream:
        np.savez_compressed(stream, **vars(golden))


def read_golden(path: Path) -> Golden:
    """Read a trace.

    Raises:
        TrackingError: there is none, an array is missing, or the numbers are none.
    """
    try:
        file = read_arrays(path, str(path), expected="golden.npz of a policy bundle", error=TrackingError)
        golden = Golden(**{f.name: np.asarray(file[f.name], dtype=float) for f in fields(Golden)})
    except (TypeError, ValueError, KeyError) as e:
        raise _refused(path, f"no golden trace ({e})", "golden.npz of a policy bundle") from e
    arrays = vars(golden)
    if {len(x) if x.ndim == 2 else -1 for x in arrays.values()} & {-1, 0} or len({len(x) for x in arrays.values()}) > 1:
        raise _refused(
            path, f"arrays of {', '.join(str(x.shape) for x in arrays.values())}", "as many periods each, one at least"
        )
    wrong = [name for name, x in arrays.items() if not np.isfinite(x).all()]
    if wrong:
        raise _refused(path, f"{', '.join(wrong)} with numbers that are not finite", "finite ones")
    return golden


def _refused(path: Path, found: str, expected: str) -> TrackingError:
    return TrackingError(str(path), found=found, expected=expected, cure="export it again")


def _measured(golden: Golden, k: int) -> Measurement:
    """What the robot's sensors told at a step of the trace."""
    one = slice(k, k + 1)
    return Measurement(
        quat=golden.quat[one], gyro=golden.gyro[one], joint_pos=golden.joint_pos[one], joint_vel=golden.joint_vel[one]
    )


def replay(runner: Runner, golden: Golden) -> float:
    """The largest difference of a runner's observations, actions and targets from the trace's.

    Raises:
        TrackingError: it is over the tolerance: this runner would not do what was trained.
    """
    apart: dict[str, float] = {"observation": 0.0, "action": 0.0, "target": 0.0}
    for k in range(len(golden.quat)):
        now = _measured(golden, k)
        if k == 0:
            runner.start(now)
        target, seen = runner.act(now), runner.seen
        for name, ours in (("observation", seen), ("action", runner.last_action), ("target", target)):
            theirs = getattr(golden, name)[k]
            off = np.abs(ours[0] - theirs).max() if ours[0].shape == theirs.shape else np.inf
            apart[name] = max(apart[name], float(off) if np.isfinite(off) else np.inf)
    worst = max(apart, key=lambda name: apart[name])
    if not apart[worst] <= TOLERANCE:
        raise TrackingError(
            f"golden trace, {worst}", found=f"{apart[worst]:.2g} apart", expected=f"at most {TOLERANCE:g}",
            cure="export the bundle again; do not run this one",
        )  # fmt: skip
    return apart[worst]
