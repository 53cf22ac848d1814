"""From raw root poses and joint columns to a checked `RobotClip`: which robot, which quaternion order.

A headless robot file says neither. Forward kinematics does: read rightly, the robot stands upright with its lower
sole on one floor; read wrongly, it lies or flies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import RobotClip
from clips.config import IDENTIFY, TRAVEL
from clips.errors import ClipError
from clips.identify.joint_ranges import check_limits, refuse_other_units, unwrapped
from clips.identify.quaternion_order import OTHER_ORDER, find_quat_order, posed, sole_tilt, unit_wxyz
from clips.provenance import Finding, RawFile, ReadOptions, Repair
from robot_models import RobotModel, load_robot


def robot_clip(
    raw: RawFile,
    *,
    dialect: str,
    fps: float,
    robot: str,
    joint_names: Sequence[str],
    root_pos: Float[ndarray, "T 3"],
    root_quat: Float[ndarray, "T 4"],
    quat_order: str | None,
    joint_pos: Float[ndarray, "T J"],
    options: ReadOptions,
    customary_order: str | None = None,
    findings: Sequence[Finding] = (),
    conversions: Sequence[str] = (),
    repairs: Sequence[Repair] = (),
) -> RobotClip:
    """Check joint-space numbers against the robot they claim to move.

    Args:
        raw: the file, for messages and provenance.
        dialect: what was recognised.
        fps: frames per second.
        robot: key in the robot catalogue.
        joint_names: names of the columns of `joint_pos`, a subset of the robot's.
        root_pos: [m].
        root_quat: in the file's order.
        quat_order: "wxyz" or "xyzw" where the format states it; None: forward kinematics decides.
        joint_pos: [rad].
        options: what the user states.
        customary_order: the format's custom, where it states none: believed where forward kinematics cannot tell.
        findings: what the reader decided before.
        conversions: what the reader did to the numbers before.
        repairs: what the reader mended before.

    Raises:
        ClipError: zero quaternions, undecidable order, degrees as radians, or joints far outside their limits.
    """
    model = load_robot(robot)
    raw.check_rate(fps)
    _check_shapes(raw, len(joint_names), root_pos, root_quat, joint_pos)
    if options.travel_scale is not None:
        root_pos = root_pos * options.travel_scale
        conversions = [*conversions, f"root positions x {options.travel_scale:g}"]
    refuse_other_units(raw, model, root_pos, joint_pos, options)
    order = [model.joint(n) for n in joint_names]
    joint_pos, turns = unwrapped(model, order, joint_pos)
    finding = find_quat_order(raw, model, order, root_pos, root_quat, quat_order, customary_order, joint_pos, options)
    quat = unit_wxyz(raw, root_quat, finding.value)
    limits = check_limits(raw, model, order, joint_pos)
    named = any((f.what, f.value) == ("joint order", "by name") for f in findings)
    stands = _stands(raw, model, order, root_pos, quat, joint_pos, finding.value, named)
    notes = [*findings, finding, limits, *stands, *_absent(model, joint_names)]
    return RobotClip(
        fps=fps,
        robot=model.name,
        joint_names=tuple(joint_names),
        root_pos=root_pos,
        root_quat=quat,
        joint_pos=joint_pos,
        source=raw.source(dialect, notes, conversions, [*repairs, *turns, *_flipped(root_quat)]),
    )


def _check_shapes(raw: RawFile, joints: int, root_pos: ndarray, root_quat: ndarray, joint_pos: ndarray) -> None:
    """Refuse arrays of other frames or columns than one root and so many named joints have."""
    frames = len(root_pos)
    if joint_pos.shape != (frames, joints) or root_pos.shape != (frames, 3) or root_quat.shape != (frames, 4):
        raise ClipError(
            raw.name, found=f"joints {joint_pos.shape}, root {root_pos.shape} and {root_quat.shape}",
            expected=f"{frames} frames of {joints} joints, 3 and 4 numbers", cure="name every column once",
        )  # fmt: skip


def _flipped(quat: ndarray) -> list[Repair]:
    """Signs of quaternions that change between two frames."""
    flips = int((np.sum(quat[1:] * quat[:-1], axis=1) < 0.0).sum())
    return [Repair(what="quaternion signs made continuous", count=flips)] if flips else []


def _absent(model: RobotModel, joint_names: Sequence[str]) -> list[Finding]:
    """Joints of the robot that the file does not move."""
    absent = [j for j in model.joint_names if j not in joint_names]
    why = f"{len(joint_names)} of {len(model.joint_names)} joints are in the file"
    told = Finding(what="joints held at the default pose", value=", ".join(absent), why=why, confidence="stated")
    return [told] if absent else []


def _unit_ratio(height: float, legs: float) -> float | None:
    """The ratio of customary units by which a root's height would be that of its legs; None where none is near."""
    fits = [k for k in TRAVEL.unit_ratios if abs(k * height - legs) < 0.25 * legs]
    return fits[0] if fits else None


def _stands(
    raw: RawFile,
    model: RobotModel,
    order: list[int],
    root_pos: ndarray,
    quat: ndarray,
    joint_pos: ndarray,
    quat_order: str,
    named: bool,
) -> list[Finding]:
    """Centimetres for metres, or a root that is no pelvis, show as soles far from the floor; unnamed columns as tilt."""
    corners, up = posed(model, order, root_pos, quat, joint_pos)
    low = float(np.percentile(corners[..., 2].min(axis=(1, 2)), 5.0))
    if abs(low) > 0.5 * model.default_qpos[2] or up < 0.0:
        height = float(np.median(root_pos[:, 2]))
        factor = _unit_ratio(height, height - low) if up > 0.5 else None
        raise ClipError(
            raw.name,
            found=f"soles {low:.3g} m over the floor and the pelvis' up at {up:.2f}, read as {model.name}",
            expected="a robot on its feet: metres, z up, and the right quaternion order",
            cure="check unit and axes of the root columns, or state the other order"
            if factor is None
            else f"the root, {height:.3g} high, stands in another unit: state its factor",
            option="quat_order" if factor is None else "travel_scale",
            suggestion=OTHER_ORDER[quat_order] if factor is None else f"{factor:g}",
        )
    tilt = float(np.median(sole_tilt(corners)))
    if tilt > IDENTIFY.most_tilt and not named:  # someone who floats, say, never stands flat
        raise ClipError(
            raw.name,
            found=f"the flatter sole tilted by {1000 * tilt:.0f} mm in half of all frames, read as {model.name}",
            expected=f"feet that stand flat now and then: {model.name}'s joints in a known order",
            cure="the columns may stand in another order, or belong to another robot",
            option="source_robot",
        )
    soles = f"the lower sole is {1000 * low:.0f} mm over z = 0 and tilted by {1000 * tilt:.0f} mm"
    return [
        Finding(what="unit", value="m, rad", why=soles, confidence="measured"),
        Finding(
            what="up axis", value="z", why=f"the pelvis' upward direction along it: {up:.2f}", confidence="measured"
        ),
    ]
