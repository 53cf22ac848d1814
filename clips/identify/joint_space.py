"""From raw root poses and joint columns to a checked `RobotClip`: which robot, which quaternion order.

A headless robot file says neither. Forward kinematics does: read rightly, the robot stands upright with its lower
sole on one floor; read wrongly, it lies or flies.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import RobotClip
from clips.errors import ClipError
from clips.provenance import Finding, RawFile, ReadOptions, Repair
from robot_models import RobotModel, forward_kinematics, installed, load_robot, robot_names, sole_corners
from robot_models.maths import rotation as rot

_PROBE_FRAMES = 200
_OTHER = {"xyzw": "wxyz", "wxyz": "xyzw"}
_SOME = 0.25  # per cent of values beyond their ranges that a file read rightly may have
_MOST_BEYOND = 0.02  # share of them that no robot's own file has
_MOST_TILT = 0.06  # median height of the lower sole's edge over its other edge [m]
_RIGHT_IS_CLEAR = 1.5  # the wrong order's floor must be this many times rougher


def layouts(count: int, robot_name: str | None) -> list[tuple[str, tuple[str, ...]]]:
    """Robots, and named subsets of their joints (`variants`), that have `count` joints: (robot, joint names).

    Only the named robot where one is named, by catalogue key or by path.
    """
    found = []
    for name in [robot_name] if robot_name else [n for n in robot_names() if installed(n)]:
        robot = load_robot(name)
        for drop in ((), *robot.profile.variants.values()):
            kept = tuple(j for j in robot.joint_names if not any(re.fullmatch(p, j) for p in drop))
            if len(kept) == count:
                found.append((name, kept))
    return found


def choose_layout(raw: RawFile, count: int, options: ReadOptions) -> tuple[str, tuple[str, ...], Finding]:
    """The robot and joint names of a file with `count` nameless joint columns.

    Raises:
        ClipError: no robot, or more than one, has that many joints.
    """
    fits = layouts(count, options.source_robot)
    if len(fits) == 1:
        robot, names = fits[0]
        measured = options.source_robot is None
        return robot, names, Finding(
            what="robot", value=robot, why=f"{count} joint values; only {robot} has that many" if measured else "given",
            confidence="measured" if measured else "stated", option="source_robot",
        )  # fmt: skip
    known = ", ".join(f"{n} {len(load_robot(n).joint_names)}" for n in robot_names() if installed(n))
    raise ClipError(
        raw.name,
        found=f"{count} joint values per frame" + (f", which {len(fits)} robots have" if fits else ""),
        expected=f"a known robot's number of joints ({known})",
        cure="name the robot it was made for",
        option="source_robot",
        suggestion=fits[0][0] if fits else "my_robot.toml",
    )


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
    _refuse_other_units(raw, model, root_pos, joint_pos, options)
    orders = {"mujoco": names, "isaac": tuple(n for n in breadth_first(model) if n in names)}
    if options.joint_order is not None:
        return orders[options.joint_order], Finding(
            what="joint order", value=options.joint_order, why="given", confidence="stated", option="joint_order"
        )
    fits = {}
    probe = np.unique(np.linspace(0, len(root_pos) - 1, _PROBE_FRAMES).astype(int))
    root_pos, root_quat, joint_pos = root_pos[probe], root_quat[probe], joint_pos[probe]
    for label, order in orders.items():
        columns = [model.joint(n) for n in order]
        beyond = np.maximum(model.lower[columns] - joint_pos, joint_pos - model.upper[columns])
        rough = min(
            _roughness(_posed(model, columns, root_pos, _unit_wxyz(raw, root_quat, q), joint_pos)[0])
            for q in ("xyzw", "wxyz")
        )
        fits[label] = 100.0 * float((beyond > 0.2).mean()), 1000.0 * rough
    told = ", ".join(f"{k}: {a:.2f} % beyond the ranges, soles rough by {b:.0f} mm" for k, (a, b) in fits.items())
    (share, rough), (share_isaac, rough_isaac) = fits["mujoco"], fits["isaac"]
    if share > _SOME >= share_isaac and rough_isaac < rough / _RIGHT_IS_CLEAR:
        return orders["isaac"], Finding(
            what="joint order", value="isaac", why=told, confidence="measured", option="joint_order"
        )
    if share > _SOME and share_isaac < 0.5 * share:
        raise ClipError(
            raw.name, found=f"no clear joint order ({told})", expected="one that keeps the ranges and stands on a floor",
            cure="state it", option="joint_order", suggestion="isaac",
        )  # fmt: skip
    clear = share <= _SOME < share_isaac or rough < rough_isaac
    return names, Finding(
        what="joint order",
        value="mujoco",
        why=told,
        confidence="measured" if clear else "assumed",
        option="joint_order",
    )


def _refuse_other_units(
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


def breadth_first(robot: RobotModel) -> tuple[str, ...]:
    """Joint names in Isaac's order: level by level down the tree, siblings in file order."""
    m = robot.model
    level = [robot.body_ids[0]]
    names = []
    while level:
        level = [b for parent in level for b in range(1, m.nbody) if m.body_parentid[b] == parent and b != parent]
        names += [m.joint(int(m.body_jntadr[b])).name for b in level if m.body_jntnum[b]]
    return tuple(names)


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
        quat_order: "wxyz" or "xyzw" where the format states it; with a "?" where that is only its custom, which
            forward kinematics may overrule; None: forward kinematics decides.
        joint_pos: [rad].
        options: what the user states.
        findings: what the reader decided before.
        conversions: what the reader did to the numbers before.
        repairs: what the reader mended before.

    Raises:
        ClipError: zero quaternions, undecidable order, degrees as radians, or joints far outside their limits.
    """
    model = load_robot(robot)
    raw.check_rate(fps)
    _refuse_other_units(raw, model, root_pos, joint_pos, options)
    order = [model.joint(n) for n in joint_names]
    joint_pos, unwrapped = _unwrapped(model, order, joint_pos)
    flips = int((np.sum(root_quat[1:] * root_quat[:-1], axis=1) < 0.0).sum())
    signs = [Repair(what="quaternion signs made continuous", count=flips)] if flips else []
    finding = _quat_order(raw, model, order, root_pos, root_quat, quat_order, joint_pos, options)
    quat = _unit_wxyz(raw, root_quat, finding.value)
    limits = _check_limits(raw, model, order, joint_pos)
    named = any((f.what, f.value) == ("joint order", "by name") for f in findings)
    stands = _stands(raw, model, order, root_pos, quat, joint_pos, finding.value, named)
    absent = [j for j in model.joint_names if j not in joint_names]
    notes = [*findings, finding, limits, *stands]
    if absent:
        why = f"{len(joint_names)} of {len(model.joint_names)} joints are in the file"
        notes.append(
            Finding(what="joints held at the default pose", value=", ".join(absent), why=why, confidence="stated")
        )
    return RobotClip(
        fps=fps,
        robot=model.name,
        joint_names=tuple(joint_names),
        root_pos=root_pos,
        root_quat=quat,
        joint_pos=joint_pos,
        source=raw.source(dialect, notes, conversions, [*repairs, *unwrapped, *signs]),
    )


def full_qpos(clip: RobotClip, robot: RobotModel) -> Float[ndarray, "T nq"]:
    """qpos of a robot clip in the robot's joint order; joints that the clip lacks stand at the default pose."""
    qpos = np.tile(robot.default_qpos, (clip.frames, 1))
    qpos[:, :3], qpos[:, 3:7] = clip.root_pos, clip.root_quat
    qpos[:, [7 + robot.joint(n) for n in clip.joint_names]] = clip.joint_pos
    return qpos


def _quat_order(
    raw: RawFile,
    model: RobotModel,
    order: list[int],
    root_pos: ndarray,
    root_quat: ndarray,
    stated: str | None,
    joint_pos: ndarray,
    options: ReadOptions,
) -> Finding:
    custom = (stated or "").removesuffix("?")
    if options.quat_order or custom == stated:
        why = "given" if options.quat_order else "the format says so"
        value = options.quat_order or custom
        return Finding(what="quaternion order", value=value, why=why, confidence="stated", option="quat_order")
    rough, upright = {}, {}
    for name in ("xyzw", "wxyz"):
        quat = _unit_wxyz(raw, root_quat, name)
        corners, upright[name] = _posed(model, order, root_pos, quat, joint_pos)
        rough[name] = _roughness(corners)
    best, other = sorted(rough, key=lambda n: (upright[n] < 0.0 < upright[_OTHER[n]] - 0.5, rough[n]))
    why = (
        f"lower sole rough by {1000 * rough[best]:.0f} mm and pelvis up {upright[best]:.2f} read so, "
        f"{1000 * rough[other]:.0f} mm and {upright[other]:.2f} read as {other}"
    )
    stands = upright[best] - 0.5 > 0.0 > upright[other]
    if stands or (rough[other] >= _RIGHT_IS_CLEAR * rough[best] and upright[best] > upright[other] - 0.1):
        return Finding(what="quaternion order", value=best, why=why, confidence="measured", option="quat_order")
    if custom:
        why = f"the dialect's custom; not settled by forward kinematics ({best}: {why})"
        return Finding(what="quaternion order", value=custom, why=why, confidence="assumed", option="quat_order")
    raise ClipError(
        raw.name, found=f"no clear quaternion order ({best}: {why})", expected="one that stands on a floor",
        cure="state it", option="quat_order", suggestion=best,
    )  # fmt: skip


def _posed(
    model: RobotModel, order: list[int], root_pos: ndarray, quat: ndarray, joint_pos: ndarray
) -> tuple[ndarray, float]:
    """Sole corners of a sample of frames, and the median of the pelvis' upward direction."""
    frames = np.unique(np.linspace(0, len(root_pos) - 1, _PROBE_FRAMES).astype(int))
    qpos = np.tile(model.default_qpos, (len(frames), 1))
    qpos[:, :3], qpos[:, 3:7] = root_pos[frames], quat[frames]
    qpos[:, [7 + i for i in order]] = joint_pos[frames]
    corners = sole_corners(model, *forward_kinematics(model, qpos))
    up = rot.rotate(qpos[:, 3:7], np.broadcast_to([0.0, 0.0, 1.0], (len(frames), 3)))[:, 2]
    return corners, float(np.median(up))


def _roughness(corners: Float[ndarray, "T 2 4 3"]) -> float:
    """Spread of the lower sole's height plus its tilt [m]: both are small only for a file read rightly."""
    # A quarter of the time any dancer has a foot flat; half of it some are on their toes.
    return float(np.std(corners[..., 2].min(axis=(1, 2))) + np.percentile(_tilt(corners), 25.0))


def _tilt(corners: Float[ndarray, "T 2 4 3"]) -> Float[ndarray, "T"]:
    """How much higher than its lowest corner the highest corner of the flatter sole is [m]."""
    return np.asarray(np.ptp(corners[..., 2], axis=2).min(axis=1))


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
    corners, up = _posed(model, order, root_pos, quat, joint_pos)
    low = float(np.percentile(corners[..., 2].min(axis=(1, 2)), 5.0))
    if abs(low) > 0.5 * model.default_qpos[2] or up < 0.0:
        raise ClipError(
            raw.name,
            found=f"soles {low:.3g} m over the floor and the pelvis' up at {up:.2f}, read as {model.name}",
            expected="a robot on its feet: metres, z up, and the right quaternion order",
            cure="check unit and axes of the root columns, or state the other order",
            option="quat_order",
            suggestion=_OTHER[quat_order],
        )
    tilt = float(np.median(_tilt(corners)))
    if tilt > _MOST_TILT and not named:  # someone who floats, say, never stands flat
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


def _unwrapped(model: RobotModel, order: list[int], joint_pos: ndarray) -> tuple[ndarray, list[Repair]]:
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


def _unit_wxyz(raw: RawFile, quat: ndarray, order: str) -> ndarray:
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


def _check_limits(raw: RawFile, model: RobotModel, order: list[int], joint_pos: ndarray) -> Finding:
    """Degrees, or another robot's joint order, show as joints far outside their limits."""
    lower, upper = model.lower[order], model.upper[order]
    beyond = np.maximum(lower - joint_pos, joint_pos - upper)
    share = float((beyond > 0.2).mean())
    worst = int(np.argmax(beyond.max(axis=0)))
    name = model.joint_names[order[worst]]
    if share > _MOST_BEYOND:
        raise ClipError(
            f"{raw.name}, joint '{name}'",
            found=f"{100 * share:.0f} % of all joint values over 0.2 rad outside {model.name}'s limits",
            expected=f"{model.name}'s joints in its own order",
            cure="the file may belong to another robot or joint order",
            option="source_robot",
        )
    why = f"{100 * share:.2f} % of values lie over 0.2 rad outside the joint limits, worst {name} by {beyond.max():.2f} rad"
    return Finding(what="joint limits", value="kept" if share == 0 else "nearly kept", why=why, confidence="measured")
