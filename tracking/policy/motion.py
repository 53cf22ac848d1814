"""What a policy performs: the tables of a reference, by frame, as its runner looks them up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import Reference
from robot_models.maths import rotation as rot
from tracking.errors import TrackingError
from tracking.policy.contract import FROM_REFERENCE, FROM_ZERO, Contract
from tracking.policy.feed_forward import joint_targets


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What the policy performs, by frame, joints in the policy's order."""

    joint_pos: Float[ndarray, "T J"]  # [rad]
    joint_vel: Float[ndarray, "T J"]  # [rad/s]
    root_pos: Float[ndarray, "T 3"]  # [m]
    root_quat: Float[ndarray, "T 4"]
    anchor_pos: Float[ndarray, "T 3"]  # [m]
    anchor_quat: Float[ndarray, "T 4"]
    targets: Float[ndarray, "T J"]  # of the servos, without the policy [rad]
    root_lin_vel: Float[ndarray, "T 3"]  # root body [m/s]
    root_ang_vel: Float[ndarray, "T 3"]  # root body [rad/s]
    last: Int[ndarray, "T"]  # frame at which the reference that each frame is of ends
    start: int = 0  # the dance's first frame, after the lead-in


def _check_performs(reference: Reference, contract: Contract) -> None:
    if reference.joint_names != contract.joint_names:
        raise TrackingError(
            "reference, joint_names", found=str(reference.joint_names)[:60],
            expected=f"{str(contract.joint_names)[:60]}, as in the contract",
        )  # fmt: skip
    if contract.control_dt != 1.0 / reference.fps:
        rate = f"{1.0 / contract.control_dt:g} frames per second"
        raise TrackingError(
            "reference, control_dt", found=f"{reference.fps:g} frames per second", expected=f"{rate}, as in the contract",
            cure=f"retarget the clip at {rate}",
        )  # fmt: skip
    if contract.anchor not in reference.body_names:
        raise TrackingError("reference, body_names", found=f"no {contract.anchor}", expected="the contract's anchor")


def motion_of(reference: Reference, contract: Contract) -> Motion:
    """The tables of a reference that a policy of our own performs.

    Raises:
        TrackingError: its joints, their order or its rate are not the contract's.
    """
    _check_performs(reference, contract)
    anchor = reference.body_names.index(contract.anchor)
    to_root = rot.conjugate(np.asarray(reference.body_quat_w[:, 0], dtype=float))
    return Motion(
        joint_pos=np.asarray(reference.joint_pos, dtype=float),
        joint_vel=np.asarray(reference.joint_vel, dtype=float),
        root_pos=np.asarray(reference.body_pos_w[:, 0], dtype=float),
        root_quat=np.asarray(reference.body_quat_w[:, 0], dtype=float),
        anchor_pos=np.asarray(reference.body_pos_w[:, anchor], dtype=float),
        anchor_quat=np.asarray(reference.body_quat_w[:, anchor], dtype=float),
        targets=_targets(reference, contract),
        root_lin_vel=rot.rotate(to_root, np.asarray(reference.body_lin_vel_w[:, 0], dtype=float)),
        root_ang_vel=rot.rotate(to_root, np.asarray(reference.body_ang_vel_w[:, 0], dtype=float)),
        last=np.full(reference.frames, reference.frames - 1),
        start=reference.dance.start,
    )


def one_after_another(motions: Sequence[Motion]) -> Motion:
    """Several motions as one table, as a task has several references; none goes on into the next."""
    names = [f.name for f in fields(Motion) if f.name not in ("last", "start")]
    tables = {name: np.concatenate([getattr(m, name) for m in motions]) for name in names}
    lengths = [len(m.joint_pos) for m in motions]
    return Motion(**tables, last=np.repeat(np.cumsum(lengths) - 1, lengths), start=motions[0].start)


def _targets(reference: Reference, contract: Contract) -> Float[ndarray, "T J"]:
    """What the scaled action is added to, by frame."""
    if contract.target == FROM_REFERENCE:
        return joint_targets(reference, contract)
    if contract.target == FROM_ZERO:
        return np.zeros(reference.joint_pos.shape)
    share = np.array(contract.feed_forward or np.zeros(len(contract.joint_names)))
    return contract.default_joint_pos + share * contract.kd / contract.kp * np.asarray(reference.joint_vel, dtype=float)
