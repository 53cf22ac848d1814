"""A profile for a robot that has none: drafted from its model file, every guess marked and named."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robot_models.build import BODY_BIT, build_robot
from robot_models.draft.estimates import Estimate, UnprofiledModel, doubted_ranges, estimate_pose, estimate_servos
from robot_models.draft.forearms import doubted_limbs, find_ends
from robot_models.draft.hulls import capsules_of, surface_points
from robot_models.draft.level_feet import levelled
from robot_models.draft.limb_capsules import limb_capsules, whole_limbs
from robot_models.draft.stance import FACES, Sole, check_stance, soles_of, stood_up
from robot_models.incoming import Linkage, turned
from robot_models.model import RobotModel
from robot_models.model_file import linkages
from robot_models.profile import FEET, LANDMARKS, Capsule, read_profile

_DRESSED = 0.6  # of its bodies have a surface, of a robot whose file shows what it looks like
_TOLD = 4  # ties of a linkage in a note


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A profile's text, and what a person has to look at."""

    text: str
    guesses: tuple[str, ...]


def draft_profile(path: Path, name: str, out: Path, *, licence: str = "", origin: str = "") -> Draft:
    """Draft the profile of a URDF or MJCF humanoid.

    Args:
        path: the model file.
        name: of the robot.
        out: where the profile will stand, for the model's path in it.
        licence: of the model file, where it is known.
        origin: where it is from; by default its name.

    Raises:
        RobotError: no humanoid, or one that does not stand along z and face +x at zero; joints without limits.
    """
    unprofiled, turns, yaw = stood_up(path)
    linkage = linkages(path)
    model, limbs = unprofiled.model, unprofiled.limbs
    bodies = [model.body(b).name for b in range(1, model.nbody) if model.body_jntnum[b]]
    points = turned(surface_points(path, bodies), turns)
    check_stance(unprofiled, points, path)
    soles, notes = soles_of(unprofiled, points)
    ankle = unprofiled.data.body(limbs.legs["left"][-1]).xpos[2]
    servos = estimate_servos(unprofiled, float(unprofiled.data.subtree_com[1][2] - ankle) - soles["left"][2], path)
    pose = levelled(unprofiled, estimate_pose(unprofiled, {side: x for side, (x, _, _) in soles.items()}))
    ends, hands = find_ends(unprofiled, points)
    bare = _bare(unprofiled, [b for b in bodies if b not in limbs.loose], path)
    capsules = capsules_of(points, bare)
    dressed = len(points) > _DRESSED * len(bodies)
    along = limb_capsules(unprofiled, soles, ends, set(bare) - ({c.body for c in capsules} if dressed else set()))
    shapes = [*capsules, *along] if dressed else whole_limbs(capsules, along)
    capsules, along = ([c for c in shapes if c in some] for some in (capsules, along))
    notes = [
        "friction: 0.8, rubber on a hall floor",
        *(
            [f"freeze: {len(unprofiled.loose)} joints of fingers, grippers or toes are held at zero"]
            if unprofiled.loose
            else []
        ),
        *([f"upright: the frames of {', '.join(turns)} are turned to x ahead, z up"] if turns else []),
        *(
            [f"yaw: it faces {FACES[round(np.degrees(yaw)) % 360]} in its file, and is turned to face +x"]
            if yaw
            else []
        ),
        *notes,
        *_ties(linkage),
        *([f"capsules: {len(capsules)} around the meshes, one per body"] if capsules else []),
        *(
            [
                f"capsules: {len(along)} along limbs and soles without a surface that is thick enough, as thick as humanoids' are"
            ]
            if along
            else []
        ),
        *servos.notes,
        *pose.notes,
        *doubted_ranges(unprofiled),
        *hands,
        *doubted_limbs(unprofiled, ends),
    ]
    rights = licence or "unknown: look it up before you pass it on", origin or path.name
    blocks = [
        [*_head(unprofiled, path, name, out, rights, linkage.pairs), *_upright(tuple(turns), yaw)],
        *_tables("joints.", servos),
        *_tables("", pose),
        *(_sole(side, limbs.legs[side][-1], soles[side]) for side in FEET),
        *map(_capsule, (*capsules, *along)),
        ["[landmarks]  # GUESSED from the tree", *(f'{k} = "{unprofiled.landmarks[k]}"' for k in LANDMARKS)],
        *([["[ends]  # GUESSED", *(f"{k} = {list(v)}" for k, v in ends.items())]] if ends else []),
        _tracking(unprofiled),
    ]
    return Draft(text="\n\n".join("\n".join(block) for block in blocks) + "\n", guesses=tuple(notes))


def _overlapping(robot: RobotModel) -> set[tuple[str, str]]:
    """Pairs of bodies that touch in the default pose or with all joints at zero."""
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    pairs: set[tuple[str, str]] = set()
    for joints in (robot.default_qpos[7:], np.zeros(model.nu)):
        data.qpos[:] = robot.default_qpos
        data.qpos[7:] = np.clip(joints, robot.lower, robot.upper)
        mujoco.mj_forward(model, data)
        for contact in data.contact:
            if all(model.geom_contype[g] & BODY_BIT for g in contact.geom):
                a, b = sorted(model.body(int(model.geom_bodyid[g])).name for g in contact.geom)
                pairs.add((a, b))
    return pairs


def without_overlaps(draft: Draft, out: Path) -> Draft:
    """The draft with those pairs of bodies excluded that overlap already where the robot stands.

    Args:
        draft: written to `out` before.
        out: its file.
    """
    pairs = _overlapping(build_robot(read_profile(out)))
    if not pairs:
        return draft
    rows = "".join(f'  ["{a}", "{b}"],\n' for a, b in sorted(pairs))
    note = f"excludes: {len(pairs)} pairs of bodies overlap already where the robot stands"
    text = draft.text.replace(
        "excludes = []\n", f"# GUESSED: they overlap where the robot stands\nexcludes = [\n{rows}]\n"
    )
    return Draft(text=text, guesses=(*draft.guesses, note))


def _bare(unprofiled: UnprofiledModel, bodies: Sequence[str], path: Path) -> Sequence[str]:
    """Bodies that need a capsule: those that the file gives no primitive.

    All of a URDF's, if one does: where a profile has capsules, they stand for the whole surface of a URDF.
    """
    model = unprofiled.model
    dressed = {model.body(int(b)).name for b in model.geom_bodyid}
    bare = [b for b in bodies if b not in dressed]
    return bodies if bare and path.suffix.lower() == ".urdf" else bare


def _upright(bodies: Sequence[str], yaw: float) -> list[str]:
    """What is said of frames that are turned."""
    return [*([f"upright = {_listed(bodies)}"] if bodies else []), *([f"yaw = {yaw:.7g}"] if yaw else [])]


def _ties(linkage: Linkage) -> list[str]:
    """What is said of linkages: the tree is serial, and who drives a joint through rods has other limits."""
    by_motors: dict[tuple[str, ...], list[str]] = {}
    for joint, motors in linkage.driven.items():
        by_motors.setdefault(motors, []).append(joint)
    notes = [
        f"linkages: {' and '.join(joints)} have the torques that {' and '.join(motors)} give them through rods or gears at zero"
        for motors, joints in by_motors.items()
    ]
    left, tied = linkage.left, ", ".join(linkage.left[:_TOLD])
    listed = tied + (f" and {len(left) - _TOLD} more" if len(left) > _TOLD else "")
    return notes + [
        f"linkages: {listed} are left out, every joint moves by itself: state the torques and speeds that they have at the "
        "joints, and motor_pairs of joints that two motors move together"
    ] * bool(left)


def _head(
    unprofiled: UnprofiledModel,
    path: Path,
    name: str,
    out: Path,
    rights: tuple[str, str],
    pairs: Sequence[tuple[str, str]],
) -> list[str]:
    try:
        where = path.resolve().relative_to(out.resolve().parent)
    except ValueError:
        where = path.resolve()
    return [
        f"# Drafted from {path.name}. Tables marked GUESSED hold what is not in that file: look at each of them.",
        f'name = "{name}"',
        f'title = "{name}, {len(unprofiled.joints)} joints"',
        f'root = "{unprofiled.model.body(1).name}"',
        "friction = 0.8",
        *([f"freeze = {_listed(unprofiled.loose)}"] if unprofiled.loose else []),
        "excludes = []",
        *(["motor_pairs = [", *(f'  ["{a}", "{b}"],' for a, b in pairs), "]"] if pairs else []),
        "",
        "[source]",
        f'path = "{where.as_posix()}"',
        f'licence = "{rights[0]}"',
        f'origin = "{rights[1]}"',
        'inertia = "repair"',
    ]


def _tables(prefix: str, guess: Estimate) -> Iterable[list[str]]:
    for key, values in guess.tables.items():
        mark = "  # GUESSED" if key in guess.guessed else ""
        yield [f"[{prefix}{key}]{mark}", *(f'"{n}" = {float(f"{v:.6g}")!r}' for n, v in values.items() if v)]


def _sole(side: str, body: str, sole: Sole) -> list[str]:
    (x0, x1), (y0, y1), z = sole
    corners = ", ".join(f"[{x:.4f}, {y:.4f}]" for x in (x0, x1) for y in (y0, y1))
    return [
        f"[soles.{side}]  # GUESSED", f'body = "{body}"', f"x = [{x0:.4f}, {x1:.4f}]", f"y = [{y0:.4f}, {y1:.4f}]", f"z = {z:.4f}",
        f"points = [{corners}]",
    ]  # fmt: skip


def _capsule(c: Capsule) -> list[str]:
    return [
        f"[capsules.{c.name}]", f'body = "{c.body}"', f"from = {list(c.start)}", f"to = {list(c.end)}", f"radius = {c.radius}"
    ]  # fmt: skip


def _tracking(unprofiled: UnprofiledModel) -> list[str]:
    model, marks = unprofiled.model, unprofiled.landmarks
    tracked = [unprofiled.limbs.pelvis, *(marks[f"{s}_{p}"] for s in FEET for p in ("hip", "knee", "foot"))]
    tracked += [unprofiled.limbs.torso, *(marks[f"{s}_{p}"] for s in FEET for p in ("shoulder", "elbow", "wrist"))]
    site = next((model.site(i).name for i in range(model.nsite) if "imu" in model.site(i).name.lower()), "")
    return ["[tracking]", f'anchor = "{unprofiled.limbs.torso}"', f'imu = "{site}"', f"bodies = {_listed(tracked)}"]


def _listed(names: Sequence[str]) -> str:
    return "[\n" + "".join(f'  "{n}",\n' for n in dict.fromkeys(names)) + "]"
