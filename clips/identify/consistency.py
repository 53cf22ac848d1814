"""A file held against itself, where it says one thing twice: names and places, velocities and differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.identify.joint_layout import breadth_first
from clips.provenance import FASTEST, SLOWEST, Finding, RawFile
from robot_models import RobotModel, forward_kinematics
from robot_models.maths import rotation as rot

MOST_MISFIT = IDENTIFY.bodies_fit  # of bodies and joints that are named rightly [m]


def misfit(
    robot: RobotModel,
    joints: Sequence[str],
    joint_pos: Float[ndarray, "T J"],
    bodies: Sequence[str],
    places: Float[ndarray, "T B 3"],
) -> float:
    """How far the bodies that a file states are from those that its joint angles give [m], worst of some frames.

    Args:
        robot: whose joints and bodies they are.
        joints: names of the columns of `joint_pos`; others rest.
        joint_pos: [rad].
        bodies: names of the columns of `places`; those that the robot does not have say nothing.
        places: of the bodies' origins in the root body's frame [m].
    """
    frames = np.unique(np.linspace(0, len(joint_pos) - 1, IDENTIFY.bodies_frames).astype(int))
    known = [(column, robot.body(name)) for column, name in enumerate(bodies) if name in robot.body_names[1:]]
    if not known:
        return 0.0
    qpos = np.tile(robot.zero_qpos, (len(frames), 1))
    qpos[:, 7:] = robot.default_joint_pos
    qpos[:, [7 + robot.joint(name) for name in joints]] = joint_pos[frames]
    pos, quat = forward_kinematics(robot, qpos)
    local = rot.rotate(np.broadcast_to(rot.conjugate(quat[:, :1]), quat.shape), pos - pos[:, :1])
    columns, ids = zip(*known, strict=True)
    return float(np.linalg.norm(local[:, list(ids)] - places[frames][:, list(columns)], axis=-1).max())


def order_that_fits(
    robot: RobotModel,
    joints: Sequence[str],
    joint_pos: Float[ndarray, "T J"],
    bodies: Sequence[str],
    places: Float[ndarray, "T B 3"],
) -> str:
    """Which other order of the names would fit the numbers, in words; "" where none of the customary ones does."""
    for order, other in _orders(robot, "joint", joints).items():
        if misfit(robot, other, joint_pos, bodies, places) < IDENTIFY.bodies_fit:
            return f"joint names {order}"
    for order, other in _orders(robot, "body", bodies).items():
        if misfit(robot, joints, joint_pos, other, places) < IDENTIFY.bodies_fit:
            return f"body names {order}"
    return ""


def check_against_bodies(
    raw: RawFile,
    robot: RobotModel,
    joints: Sequence[str],
    joint_pos: Float[ndarray, "T J"],
    bodies: Sequence[str],
    places: Float[ndarray, "T B 3"],
) -> Finding:
    """That the joints of a file are named as its bodies show them.

    Raises:
        ClipError: forward kinematics of its joints gives other bodies than it states, or these are no numbers.
    """
    if not np.isfinite(places).all():
        raise ClipError(f"{raw.name}, places of bodies", found="numbers that are not finite", expected="metres")
    if not set(bodies) & set(robot.body_names[1:]):
        why = f"none of its bodies ({', '.join(bodies[:3])} ...) is one of {robot.name}'s"
        return Finding(what="joint names", value="as stated", why=why, confidence="stated")
    off = misfit(robot, joints, joint_pos, bodies, places)
    fits = order_that_fits(robot, joints, joint_pos, bodies, places) if off > IDENTIFY.bodies_fit else ""
    if fits or off > IDENTIFY.bodies_off:
        raise ClipError(
            raw.name, found=f"joint angles that put its own bodies {off:.2f} m away from where it says they are",
            expected="names in the order of the numbers",
            cure=f"they fit with {fits}: correct the names" if fits else "correct the names; or is it another robot's file?",
        )  # fmt: skip
    why = f"forward kinematics gives its own bodies to {1000 * off:.2g} mm"
    sure = off <= IDENTIFY.bodies_fit
    why += "" if sure else ": another version of the robot's model, it seems"
    return Finding(
        what="joint names", value="as its bodies show", why=why, confidence="measured" if sure else "assumed"
    )


def check_against_velocities(
    raw: RawFile, joint_pos: Float[ndarray, "T J"], joint_vel: Float[ndarray, "T J"], fps: float
) -> Finding | None:
    """That the rate of a file is the one by which its velocities follow from its positions; None where they tell nothing.

    Raises:
        ClipError: they follow at another rate.
    """
    if joint_vel.shape != joint_pos.shape or len(joint_pos) < 3:
        return None
    some = np.unique(np.linspace(1, len(joint_pos) - 2, 10 * IDENTIFY.probe_frames).astype(int))
    change = 0.5 * (joint_pos[some + 1].astype(float) - joint_pos[some - 1]) * fps
    moving = np.abs(change) > IDENTIFY.moving
    if moving.sum() < IDENTIFY.probe_frames:
        return None
    ratio = float(np.median(joint_vel[some][moving] / change[moving]))
    if not abs(ratio) > IDENTIFY.no_velocity:  # placeholders: zeros, or no numbers
        return None
    if ratio < 0.0 or abs(np.log(ratio)) > np.log(IDENTIFY.rates_fit):
        fits = f"{fps * ratio:.4g}" if SLOWEST <= fps * ratio <= FASTEST else ""
        raise ClipError(
            raw.name, found=f"joint velocities {ratio:.2f} times those of its positions at {fps:.6g} frames per second",
            expected=f"one rate for both: {fits} fits" if fits else "velocities that follow from the positions",
            cure="state the rate, which is believed then", option="fps", suggestion=fits or f"{fps:.6g}",
        )  # fmt: skip
    why = f"joint velocities are {ratio:.3f} times the differences of the positions"
    return Finding(what="rate", value="as its velocities show", why=why, confidence="measured")


def _orders(robot: RobotModel, what: str, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Customary orders of the same names."""
    other_side = _exchanged(names)
    depth = robot.joint_names if what == "joint" else robot.body_names
    breadth = breadth_first(robot)
    if what == "body":
        moved = dict(zip(robot.joint_names, robot.body_names[1:], strict=True))
        breadth = (robot.body_names[0], *(moved[joint] for joint in breadth))
    found = {
        "with left and right exchanged": other_side,
        "in MuJoCo's depth-first order": tuple(n for n in depth if n in names),
        "in Isaac's breadth-first order": tuple(n for n in breadth if n in names),
    }
    parts = dict.fromkeys(name.removeprefix("left_") for name in names if name.startswith("left_"))
    found |= {f"with left and right {part} exchanged": _exchanged(names, part) for part in parts}
    return {order: other for order, other in found.items() if sorted(other) == sorted(names)}


def _exchanged(names: Sequence[str], part: str = "") -> tuple[str, ...]:
    """The names with left and right exchanged, of all or of one part of the body."""
    swap = {"left": "right", "right": "left"}
    return tuple(
        "_".join(swap.get(word, word) for word in name.split("_")) if name.endswith(part) else name for name in names
    )
