"""Whether joint columns can be a robot's angles: units, full turns, ranges."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.provenance import Finding, RawFile, ReadOptions, Repair
from robot_models import RobotModel


def refuse_other_units(
    raw: RawFile, model: RobotModel, root_pos: ndarray, joint_pos: ndarray, options: ReadOptions
) -> None:
    """Degrees and centimetres, before anything is concluded from them; and options that would have no effect."""
    for option, given in (("unit", options.unit not in (None, "m")), ("up", options.up not in (None, "z"))):
        if given:
            raise ClipError(
                f"{raw.name}, option {option}", found="a robot's own file beside it", expected="metres and z up",
                cure="convert the file, or leave the option out", option=option,
            )  # fmt: skip
    largest, height = (
        np.abs(joint_pos).max(initial=0.0),
        float(np.median(np.abs(root_pos[:, 2]))) if len(root_pos) else 0.0,
    )
    if largest > 4.0 * np.pi:
        raise ClipError(
            f"{raw.name}, joint angles", found=f"an angle of {largest:.3g}", expected="radians",
            cure="the file seems to hold degrees: convert it",
        )  # fmt: skip
    if height > 10.0 * model.default_qpos[2]:
        raise ClipError(
            raw.name, found=f"a root {height:.3g} m up, so soles {height - model.default_qpos[2]:.3g} m over the floor",
            expected=f"metres: {model.name} stands {model.default_qpos[2]:.2f} m up",
            cure="check unit and axes of the root columns: these look like centimetres or millimetres",
        )  # fmt: skip


def unwrapped(model: RobotModel, order: list[int], joint_pos: ndarray) -> tuple[ndarray, list[Repair]]:
    """Joint angles without jumps of a full turn, each joint brought to the turn nearest to its range."""
    jumps = len(joint_pos) > 1 and np.abs(np.diff(joint_pos, axis=0)).max() > np.pi
    smooth = np.unwrap(joint_pos, axis=0) if jumps else joint_pos
    middle = 0.5 * (model.lower[order] + model.upper[order])
    turns = 2.0 * np.pi * np.round((np.median(smooth, axis=0) - middle) / (2.0 * np.pi))
    # Degrees look like many turns: leave them to the limit check, which names them.
    out = np.where(np.abs(joint_pos).max(axis=0) < 4.0 * np.pi, smooth - turns, joint_pos)
    changed = np.abs(out - joint_pos) > 1e-9
    if not changed.any():
        return out, []
    names = ", ".join(model.joint_names[order[k]] for k in np.flatnonzero(changed.any(axis=0)))
    return out, [Repair(what=f"full turns taken out of {names}", count=int(changed.sum()), of="samples")]


def check_limits(raw: RawFile, model: RobotModel, order: list[int], joint_pos: ndarray) -> Finding:
    """Degrees, or another robot's joint order, show as joints far outside their limits."""
    lower, upper = model.lower[order], model.upper[order]
    beyond = np.maximum(lower - joint_pos, joint_pos - upper)
    share = float((beyond > 0.2).mean())
    worst = int(np.argmax(beyond.max(axis=0)))
    name = model.joint_names[order[worst]]
    if share > IDENTIFY.beyond_wrong:
        raise ClipError(
            f"{raw.name}, joint '{name}'",
            found=f"{100 * share:.0f} % of all joint values over 0.2 rad outside {model.name}'s limits",
            expected=f"{model.name}'s joints in its own order",
            cure="the file may belong to another robot or joint order",
            option="source_robot",
        )
    why = f"{100 * share:.2f} % of values lie over 0.2 rad outside the joint limits, worst {name} by {beyond.max():.2f} rad"
    return Finding(what="joint limits", value="kept" if share == 0 else "nearly kept", why=why, confidence="measured")
