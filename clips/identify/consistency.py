"""A file held against itself, where it says one thing twice: names and places, velocities and differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.identify.joint_layout import breadth_first
from clips.provenance import FASTEST, SLOWEST, Finding, RawFile
from robot_models import RobotModel, forward_kinematics
from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True, eq=False)
class NamedMotion:
    """What a file says twice: joint angles by name, and by name the places of the bodies that they move. T frames."""

    robot: RobotModel
    joints: tuple[str, ...]  # names of the columns of `joint_pos`; others rest
    joint_pos: Float[ndarray, "T J"]  # [rad]
    bodies: tuple[str, ...]  # names of the columns of `places`; those that the robot does not have say nothing
    places: Float[ndarray, "T B 3"]  # of the bodies' origins in the root body's frame [m]

    @property
    def misfit(self) -> float:
        """How far the stated bodies are from those that the joint angles give [m], worst of some frames."""
        robot, names = self.robot, self.robot.body_names[1:]
        frames = np.unique(np.linspace(0, len(self.joint_pos) - 1, IDENTIFY.bodies_frames).astype(int))
        known = [(column, robot.body(name)) for column, name in enumerate(self.bodies) if name in names]
        if not known:
            return 0.0
        qpos = np.tile(robot.zero_qpos, (len(frames), 1))
        qpos[:, 7:] = robot.default_joint_pos
        qpos[:, [7 + robot.joint(name) for name in self.joints]] = self.joint_pos[frames]
        pos, quat = forward_kinematics(robot, qpos)
        columns, ids = map(list, zip(*known, strict=True))
        found = in_root(pos, quat, 0)[:, ids]
        return float(np.linalg.norm(found - self.places[frames][:, columns], axis=-1).max())

    def contradiction(self) -> tuple[str, str] | None:
        """What is wrong, and how to mend it; None where names and numbers agree.

        Another version of the robot misses by a few centimetres and is no contradiction, unless another customary order of
        the names fits, which is told then.
        """
        off = self.misfit
        if off <= IDENTIFY.bodies_fit:
            return None
        fits = self._order_that_fits()
        if not fits and off <= IDENTIFY.bodies_off:
            return None
        found = f"joint angles that put its own bodies {off:.2f} m away from where it says they are"
        return (
            found,
            f"they fit with {fits}: correct the names" if fits else "correct the names; or is it another robot's?",
        )

    def _order_that_fits(self) -> str:
        others = {
            f"joint names {k}": replace(self, joints=v) for k, v in _orders(self.robot, "joint", self.joints).items()
        }
        others |= {
            f"body names {k}": replace(self, bodies=v) for k, v in _orders(self.robot, "body", self.bodies).items()
        }
        return next((order for order, other in others.items() if other.misfit < IDENTIFY.bodies_fit), "")


def in_root(pos: Float[ndarray, "T B 3"], quat: Float[ndarray, "T B 4"], root: int) -> Float[ndarray, "T B 3"]:
    """World positions of bodies in the frame of one of them [m]."""
    turned = np.broadcast_to(rot.conjugate(rot.normalise(quat[:, root : root + 1])), quat.shape)
    return np.asarray(rot.rotate(turned, pos - pos[:, root : root + 1]))


def check_against_bodies(raw: RawFile, motion: NamedMotion) -> Finding:
    """That the joints of a file are named as its bodies show them.

    Raises:
        ClipError: forward kinematics of its joints gives other bodies than it states, or these are no numbers.
    """
    if not np.isfinite(motion.places).all():
        raise ClipError(f"{raw.name}, places of bodies", found="numbers that are not finite", expected="metres")
    robot = motion.robot
    if not set(motion.bodies) & set(robot.body_names[1:]):
        why = f"none of its bodies ({', '.join(motion.bodies[:3])} ...) is one of {robot.name}'s"
        return Finding(what="joint names", value="as stated", why=why, confidence="stated")
    wrong = motion.contradiction()
    if wrong:
        raise ClipError(raw.name, found=wrong[0], expected="names in the order of the numbers", cure=wrong[1])
    off = motion.misfit
    sure = off <= IDENTIFY.bodies_fit
    why = f"forward kinematics gives its own bodies to {1000 * off:.2g} mm"
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
