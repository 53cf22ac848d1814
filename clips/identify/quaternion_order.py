"""Which order a robot's root quaternions stand in: read rightly, it stands upright with its lower sole on one floor."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.provenance import Finding, RawFile, ReadOptions
from robot_models import RobotModel, forward_kinematics, sole_corners
from robot_models.maths import rotation as rot

OTHER_ORDER = {"xyzw": "wxyz", "wxyz": "xyzw"}


def find_quat_order(
    raw: RawFile,
    model: RobotModel,
    order: list[int],
    root_pos: ndarray,
    root_quat: ndarray,
    stated: str | None,
    customary: str | None,
    joint_pos: ndarray,
    options: ReadOptions,
) -> Finding:
    """The order that the user or the format states, else the one that stands on a floor.

    Raises:
        ClipError: neither order is clearly the right one, and the format has no custom.
    """
    value = options.quat_order or stated
    if value is not None:
        why = "given" if options.quat_order else "the format says so"
        return Finding(what="quaternion order", value=value, why=why, confidence="stated", option="quat_order")
    rough, upright = {}, {}
    for name in ("xyzw", "wxyz"):
        quat = unit_wxyz(raw, root_quat, name)
        corners, upright[name] = posed(model, order, root_pos, quat, joint_pos)
        rough[name] = roughness(corners)
    best, other = sorted(rough, key=lambda n: (upright[n] < 0.0 < upright[OTHER_ORDER[n]] - 0.5, rough[n]))
    why = (
        f"lower sole rough by {1000 * rough[best]:.0f} mm and pelvis up {upright[best]:.2f} read so, "
        f"{1000 * rough[other]:.0f} mm and {upright[other]:.2f} read as {other}"
    )
    stands = upright[best] - 0.5 > 0.0 > upright[other]
    if stands or (rough[other] >= IDENTIFY.clear * rough[best] and upright[best] > upright[other] - 0.1):
        return Finding(what="quaternion order", value=best, why=why, confidence="measured", option="quat_order")
    if customary is not None:
        why = f"the dialect's custom; not settled by forward kinematics ({best}: {why})"
        return Finding(what="quaternion order", value=customary, why=why, confidence="assumed", option="quat_order")
    raise ClipError(
        raw.name, found=f"no clear quaternion order ({best}: {why})", expected="one that stands on a floor",
        cure="state it", option="quat_order", suggestion=best,
    )  # fmt: skip


def posed(
    model: RobotModel, order: list[int], root_pos: ndarray, quat: ndarray, joint_pos: ndarray
) -> tuple[ndarray, float]:
    """Sole corners of a sample of frames, and the median of the pelvis' upward direction."""
    frames = np.unique(np.linspace(0, len(root_pos) - 1, IDENTIFY.probe_frames).astype(int))
    qpos = np.tile(model.default_qpos, (len(frames), 1))
    qpos[:, :3], qpos[:, 3:7] = root_pos[frames], quat[frames]
    qpos[:, [7 + i for i in order]] = joint_pos[frames]
    corners = sole_corners(model, *forward_kinematics(model, qpos))
    up = rot.rotate(qpos[:, 3:7], np.broadcast_to([0.0, 0.0, 1.0], (len(frames), 3)))[:, 2]
    return corners, float(np.median(up))


def roughness(corners: Float[ndarray, "T 2 4 3"]) -> float:
    """Spread of the lower sole's height plus its tilt [m]: both are small only for a file read rightly."""
    # A quarter of the time any dancer has a foot flat; half of it some are on their toes.
    return float(np.std(corners[..., 2].min(axis=(1, 2))) + np.percentile(sole_tilt(corners), 25.0))


def sole_tilt(corners: Float[ndarray, "T 2 4 3"]) -> Float[ndarray, "T"]:
    """How much higher than its lowest corner the highest corner of the flatter sole is [m]."""
    return np.asarray(np.ptp(corners[..., 2], axis=2).min(axis=1))


def unit_wxyz(raw: RawFile, quat: ndarray, order: str) -> ndarray:
    """Unit quaternions wxyz, sign-continuous, of ones that stand in an order; refused where their length is not 1."""
    norm = np.linalg.norm(quat, axis=1)
    bad = np.flatnonzero(~(np.abs(norm - 1.0) < 0.05))
    if len(bad):
        raise ClipError(
            f"{raw.name}, frame {bad[0]}",
            found=f"root quaternion of length {norm[bad[0]]:.3g} ({len(bad)} such frames)",
            expected="length 1",
            cure="check which columns hold the rotation",
        )
    return rot.continuous(rot.normalise(quat if order == "wxyz" else rot.from_quat_xyzw(quat)))
