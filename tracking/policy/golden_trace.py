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

_LONGEST = 3000  # control periods: a minute
_UNIT = 1e-3  # of a quaternion's length off one
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
    file = read_arrays(path, str(path), expected="golden.npz of a policy bundle", error=TrackingError)
    arrays: dict[str, ndarray] = {}
    for name in (f.name for f in fields(Golden)):
        array = file.get(name, np.zeros(0))
        if array.ndim != 2 or not len(array) or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            found = f"{name}: {array.dtype} of shape {array.shape}, or numbers that are not finite"
            raise _refused(path, found, "finite numbers by control period, one period at least")
        arrays[name] = np.asarray(array, dtype=float)
    golden = Golden(**arrays)
    periods = {len(array) for array in arrays.values()}
    if len(periods) > 1 or max(periods) > _LONGEST or golden.quat.shape[1] != 4 or golden.gyro.shape[1] != 3:
        shapes = ", ".join(str(array.shape) for array in arrays.values())
        raise _refused(
            path, f"arrays of {shapes}", f"as many periods each, at most {_LONGEST}; 4 and 3 numbers of the IMU"
        )
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
    joints = {golden.joint_pos.shape[1], golden.joint_vel.shape[1], len(runner.contract.joint_names)}
    if len(joints) > 1 or np.abs(np.linalg.norm(golden.quat, axis=1) - 1.0).max() > _UNIT:
        raise TrackingError(
            "golden trace, sensors", found=f"joints {sorted(joints)}, or quaternions that are none",
            expected="the sensors of this robot", cure="export the bundle again; do not run this one",
        )  # fmt: skip
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
