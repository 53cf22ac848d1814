"""Which robot's joints the nameless columns of a file are, and in which order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.identify.joint_ranges import refuse_other_units
from clips.identify.quaternion_order import posed, roughness, unit_wxyz
from clips.provenance import Finding, RawFile, ReadOptions
from robot_models import RobotModel, installed, load_robot, robot_names

_CLEARER = 2.0  # times as far astray as the right robot
_NEAR = 150.0  # how far astray recordings of the right robot are, those that hover too


def layouts(count: int, robot_name: str | None) -> list[tuple[str, tuple[str, ...]]]:
    """Robots, and named subsets of their joints (`variants`), that have `count` joints: (robot, joint names).

    Only the named robot where one is named, by catalogue key or by path. Of two variants of a robot with as many joints the
    first is meant; the other is asked for by its own name (`g1@23dof`).
    """
    found: list[tuple[str, tuple[str, ...]]] = []
    for name in [robot_name] if robot_name else [n for n in robot_names() if installed(n)]:
        robot = load_robot(name)
        for drop in ((), *robot.profile.variants.values()):
            kept = tuple(j for j in robot.joint_names if not any(re.fullmatch(p, j) for p in drop))
            if len(kept) == count and name not in (robot for robot, _ in found):
                found.append((name, kept))
    return found


@dataclass(frozen=True, kw_only=True)
class NamelessMotion:
    """A root's way and joint columns of which nothing says whose they are."""

    root_pos: Float[ndarray, "T 3"]  # [m]
    root_quat: Float[ndarray, "T 4"]  # in either order
    joint_pos: Float[ndarray, "T J"]  # [rad]


def choose_layout(raw: RawFile, motion: NamelessMotion, options: ReadOptions) -> tuple[str, tuple[str, ...], Finding]:
    """The robot and joint names of a file with nameless joint columns.

    Of several robots with as many joints, the one that keeps its ranges and stands on its soles on the floor.

    Raises:
        ClipError: no robot has that many joints, or several do and none stands clearly better.
    """
    count = motion.joint_pos.shape[1]
    fits = layouts(count, options.source_robot)
    told = ""
    if len(fits) > 1:
        astray = {k: _astray(raw, robot, names, motion) for k, (robot, names) in enumerate(fits)}
        best, next_best = sorted(astray, key=lambda k: astray[k])[:2]
        told = ", ".join(f"{fits[k][0]} is off by {astray[k]:.0f}" for k in sorted(astray, key=lambda k: astray[k]))
        if _CLEARER * astray[best] < astray[next_best]:
            why = f"{count} joint values, which {len(fits)} robots have; in mm of its soles and per cent beyond its ranges {told}"
            finding = Finding(what="robot", value=fits[best][0], why=why, confidence="measured", option="source_robot")
            return *fits[best], finding
        fits = [fits[best], *(fit for k, fit in enumerate(fits) if k != best)]
    if len(fits) == 1:
        robot, names = fits[0]
        if options.source_robot is not None:
            return (
                robot,
                names,
                Finding(what="robot", value=robot, why="given", confidence="stated", option="source_robot"),
            )
        astray_by = _astray(raw, robot, names, motion)
        near = astray_by < _NEAR
        why = f"{count} joint values; only {robot} has that many"
        why += (
            "" if near else f", but they are off by {astray_by:.0f} in mm of its soles and per cent beyond its ranges"
        )
        return (
            robot,
            names,
            Finding(
                what="robot", value=robot, why=why, confidence="measured" if near else "assumed", option="source_robot"
            ),
        )
    known = ", ".join(f"{n} {len(load_robot(n).joint_names)}" for n in robot_names() if installed(n))
    raise ClipError(
        raw.name,
        found=f"{count} joint values per frame" + (f", which {len(fits)} robots have ({told})" if fits else ""),
        expected=f"a known robot's number of joints ({known})",
        cure="name the robot it was made for, or its profile (.toml)",
        option="source_robot",
        suggestion=fits[0][0] if fits else "",
    )


def _astray(raw: RawFile, robot: str, names: tuple[str, ...], motion: NamelessMotion) -> float:
    """How far columns are from being a robot's: its lower sole's roughness and height [mm], and ten times the per cent beyond."""
    model = load_robot(robot)
    probe = np.unique(np.linspace(0, len(motion.root_pos) - 1, IDENTIFY.probe_frames).astype(int))
    root_pos, joint_pos = motion.root_pos[probe], motion.joint_pos[probe]
    found = []
    for order in (names, tuple(n for n in breadth_first(model) if n in names)):
        columns = [model.joint(n) for n in order]
        beyond = np.maximum(model.lower[columns] - joint_pos, joint_pos - model.upper[columns])
        for quat_order in ("xyzw", "wxyz"):
            try:
                quat = unit_wxyz(raw, motion.root_quat[probe], quat_order)
            except ClipError:  # no quaternions at all: refused where they are read, with what they may be
                return np.inf
            corners, up = posed(model, columns, root_pos, quat, joint_pos)
            height = abs(float(np.percentile(corners[..., 2].min(axis=(1, 2)), 25.0)))
            share = 100.0 * float((beyond > 0.1).mean())
            found.append(1000.0 * (roughness(corners) + height) + 10.0 * share + (1000.0 if up < 0.0 else 0.0))
    return min(found)


def joint_order(
    raw: RawFile,
    robot: str,
    names: tuple[str, ...],
    root_pos: Float[ndarray, "T 3"],
    root_quat: Float[ndarray, "T 4"],
    joint_pos: Float[ndarray, "T J"],
    options: ReadOptions,
) -> tuple[tuple[str, ...], Finding]:
    """Names of nameless joint columns: MuJoCo's depth-first order, or Isaac's breadth-first where that fits and the other does not.

    Read rightly, angles stay in their ranges and the lower sole lies flat on one floor.

    Args:
        raw: the file, for messages.
        robot: key in the robot catalogue.
        names: of the joints, depth-first.
        root_pos: [m].
        root_quat: in either order.
        joint_pos: columns of the file [rad].
        options: what the user states.

    Raises:
        ClipError: neither order is clearly the right one.
    """
    model = load_robot(robot)
    refuse_other_units(raw, model, root_pos, joint_pos, options)
    orders = {"mujoco": names, "isaac": tuple(n for n in breadth_first(model) if n in names)}
    if options.joint_order is not None:
        return orders[options.joint_order], Finding(
            what="joint order", value=options.joint_order, why="given", confidence="stated", option="joint_order"
        )
    fits = {}
    probe = np.unique(np.linspace(0, len(root_pos) - 1, IDENTIFY.probe_frames).astype(int))
    root_pos, root_quat, joint_pos = root_pos[probe], root_quat[probe], joint_pos[probe]
    for label, order in orders.items():
        columns = [model.joint(n) for n in order]
        beyond = np.maximum(model.lower[columns] - joint_pos, joint_pos - model.upper[columns])
        rough = min(
            roughness(posed(model, columns, root_pos, unit_wxyz(raw, root_quat, q), joint_pos)[0])
            for q in ("xyzw", "wxyz")
        )
        fits[label] = 100.0 * float((beyond > 0.2).mean()), 1000.0 * rough
    told = ", ".join(f"{k}: {a:.2f} % beyond the ranges, soles rough by {b:.0f} mm" for k, (a, b) in fits.items())
    (share, rough), (share_isaac, rough_isaac) = fits["mujoco"], fits["isaac"]
    if share > IDENTIFY.beyond_right >= share_isaac and rough_isaac < rough / IDENTIFY.clear:
        return orders["isaac"], Finding(
            what="joint order", value="isaac", why=told, confidence="measured", option="joint_order"
        )
    if share > IDENTIFY.beyond_right and share_isaac < 0.5 * share:
        raise ClipError(
            raw.name, found=f"no clear joint order ({told})", expected="one that keeps the ranges and stands on a floor",
            cure="state it", option="joint_order", suggestion="isaac",
        )  # fmt: skip
    clear = share <= IDENTIFY.beyond_right < share_isaac or rough < rough_isaac
    return names, Finding(
        what="joint order",
        value="mujoco",
        why=told,
        confidence="measured" if clear else "assumed",
        option="joint_order",
    )


def breadth_first(robot: RobotModel) -> tuple[str, ...]:
    """Joint names in Isaac's order: level by level down the tree, siblings in file order."""
    m = robot.model
    level = [robot.body_ids[0]]
    names = []
    while level:
        level = [b for parent in level for b in range(1, m.nbody) if m.body_parentid[b] == parent and b != parent]
        names += [m.joint(int(m.body_jntadr[b])).name for b in level if m.body_jntnum[b]]
    return tuple(names)


def _joint_written_as(name: str, robot: RobotModel) -> str:
    """The joint that a header names as itself, as the link that it moves, or without its ending; "" where none is."""
    if name in robot.joint_names:
        return name
    links = dict(zip(robot.body_names[1:], robot.joint_names, strict=True))
    ended = f"{name}_joint"
    return links.get(name) or links.get(f"{name}_link") or (ended if ended in robot.joint_names else "")


def joints_by_name(raw: RawFile, written: Sequence[str], options: ReadOptions) -> tuple[str, tuple[str, ...]]:
    """The robot whose joints a file names, as joints or as the links that they move, and its own names for them.

    Raises:
        ClipError: no robot has them all, or one that has them lacks too many.
    """
    tried, fits = [], list[tuple[int, str, tuple[str, ...]]]()
    for name in [options.source_robot] if options.source_robot else [n for n in robot_names() if installed(n)]:
        robot = load_robot(name)
        joints = [_joint_written_as(w, robot) for w in written]
        unknown = [w for w, j in zip(written, joints, strict=True) if not j]
        missing = [j for j in robot.joint_names if j not in joints]
        if not unknown and len(missing) <= 0.3 * len(robot.joint_names):
            fits.append((len(missing), name, tuple(joints)))
        tried.append((len(unknown or missing), name, unknown or [f"(absent) {m}" for m in missing]))
    if fits and [lacks for lacks, _, _ in fits].count(min(fits)[0]) == 1:
        _, name, joints_of_it = min(fits)
        return name, joints_of_it
    if fits:
        alike = [name for lacks, name, _ in fits if lacks == min(fits)[0]]
        raise ClipError(
            f"{raw.name}, names of joints", found=f"names that {' and '.join(alike)} have", expected="those of one robot",
            cure="name the robot", option="source_robot", suggestion=alike[0],
        )  # fmt: skip
    _, name, unknown = min(tried)
    raise ClipError(
        f"{raw.name}, names of joints",
        found=f"names of joints that fit no robot; {name} comes nearest, without {', '.join(unknown[:6])}",
        expected="the joints or links of one robot",
        cure="name the robot, or correct the columns",
        option="source_robot",
        suggestion=name,
    )
