"""A profile for a robot that has none: drafted from its model file, every guess marked and named."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.build import BODY_BIT, build_robot
from robot_models.draft.estimates import Estimate, UnprofiledModel, doubted_ranges, estimate_pose, estimate_servos
from robot_models.draft.forearms import doubted_limbs, find_ends
from robot_models.draft.hulls import capsules_of, sole_of, surface_points
from robot_models.draft.limbs import find_limbs, joint_centre, middle_joint
from robot_models.errors import RobotError
from robot_models.model import RobotModel
from robot_models.model_file import open_spec
from robot_models.profile import FEET, LANDMARKS, Capsule, read_profile

Sole = tuple[tuple[float, float], tuple[float, float], float]
"""Back and front edge, right and left edge, height [m]."""

_UNKNOWN_SOLE: Sole = ((-0.08, 0.14), (-0.04, 0.04), -0.05)


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
    unprofiled = _open(path)
    model, limbs = unprofiled.model, unprofiled.limbs
    bodies = [model.body(b).name for b in range(1, model.nbody) if model.body_jntnum[b]]
    points = surface_points(path, bodies)
    _check_stance(unprofiled, points, path)
    soles, notes = _soles(unprofiled, points)
    ankle = unprofiled.data.body(limbs.legs["left"][-1]).xpos[2]
    servos = estimate_servos(unprofiled, float(unprofiled.data.subtree_com[1][2] - ankle) - soles["left"][2], path)
    pose = estimate_pose(unprofiled, {side: x for side, (x, _, _) in soles.items()})
    ends, hands = find_ends(unprofiled, points)
    capsules = capsules_of(points, _bare(unprofiled, [b for b in bodies if b not in limbs.loose], path))
    notes = [
        "friction: 0.8, rubber on a hall floor",
        *(
            [f"freeze: {len(unprofiled.loose)} joints of fingers, grippers or toes are held at zero"]
            if unprofiled.loose
            else []
        ),
        *notes,
        *([f"capsules: {len(capsules)} around the meshes, one per body"] if capsules else []),
        *servos.notes,
        *pose.notes,
        *doubted_ranges(unprofiled),
        *hands,
        *doubted_limbs(unprofiled, ends),
    ]
    blocks = [
        _head(
            unprofiled, path, name, out, (licence or "unknown: look it up before you pass it on", origin or path.name)
        ),
        *_tables("joints.", servos),
        *_tables("", pose),
        *(_sole(side, limbs.legs[side][-1], soles[side]) for side in FEET),
        *map(_capsule, capsules),
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


def _open(path: Path) -> UnprofiledModel:
    import mujoco

    try:
        model = open_spec(path, repair=True).compile()
    except ValueError as e:
        raise RobotError(str(path), found=f"a model that MuJoCo cannot compile ({e})", expected="a robot") from e
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    limbs = find_limbs(model, data, str(path))
    landmarks = limbs.landmarks
    for side in FEET:
        leg, arm = limbs.legs[side], limbs.arms[side]
        knee, elbow = (middle_joint(model, data, chain) for chain in (leg, arm))
        if knee == leg[-1]:
            raise RobotError(
                str(path), found=f"'{leg[-1]}', the {side} knee, at the end of its limb", expected="a foot beyond it",
                cure="give the foot a body of its own in the model file, on a joint with a small range",
            )  # fmt: skip
        landmarks |= {f"{side}_hip": joint_centre(model, data, leg), f"{side}_knee": knee}
        landmarks |= {f"{side}_shoulder": joint_centre(model, data, arm), f"{side}_elbow": elbow}
    return UnprofiledModel(model=model, data=data, limbs=limbs, landmarks=landmarks)


def _check_stance(unprofiled: UnprofiledModel, points: Mapping[str, Float[ndarray, "V 3"]], path: Path) -> None:
    """At zero the robot shall stand along z and face +x, its feet's axes the world's; one joint a body, all with ranges."""
    model, data, foot = unprofiled.model, unprofiled.data, unprofiled.limbs.legs["left"][-1]
    leg = np.array(data.body(unprofiled.landmarks["left_hip"]).xpos - data.body(foot).xpos)
    reach = float(np.mean([points[foot][:, 0].max(), points[foot][:, 0].min()])) if foot in points else 0.0
    several = [model.body(b).name for b in range(1, model.nbody) if model.body_jntnum[b] > 1]
    free = [n for n in unprofiled.joints if not model.jnt_limited[model.joint(n).id]]
    faults = (
        (leg[2] < 0.8 * np.linalg.norm(leg), f"hips over feet by {leg[0]:.2f}, {leg[1]:.2f}, {leg[2]:.2f} m along x, y, z at zero",
         "a robot that stands along z", "turn its root body in the model file"),
        (not np.allclose(data.body(foot).xmat.reshape(3, 3), np.eye(3), atol=0.02),
         f"axes of '{foot}' that are not the world's at zero", "x ahead, z up, as for a sole",
         "turn the body's frame in the model file"),
        (reach < -0.01, f"soles that reach {-100 * reach:.0f} cm further back than ahead of the ankle",
         "a robot that faces +x at zero", "turn its root body by half a turn in the model file"),
        (several, f"several joints on {', '.join(several)}", "one joint per body", "give each joint a body of its own"),
        (free, f"no position limit for {', '.join(free)}", "a range for every joint", "write the ranges into the model file"),
    )  # fmt: skip
    for fault, found, expected, cure in faults:
        if fault:
            raise RobotError(str(path), found=found, expected=expected, cure=cure)


def _bare(unprofiled: UnprofiledModel, bodies: Sequence[str], path: Path) -> Sequence[str]:
    """Bodies that need a capsule: those that the file gives no primitive.

    All of a URDF's, if one does: where a profile has capsules, they stand for the whole surface of a URDF.
    """
    model = unprofiled.model
    dressed = {model.body(int(b)).name for b in model.geom_bodyid}
    bare = [b for b in bodies if b not in dressed]
    return bodies if bare and path.suffix.lower() == ".urdf" else bare


def _soles(
    unprofiled: UnprofiledModel, points: Mapping[str, Float[ndarray, "V 3"]]
) -> tuple[dict[str, Sole], list[str]]:
    soles, notes = {}, []
    for side in FEET:
        body = unprofiled.limbs.legs[side][-1]
        soles[side] = sole_of(points[body]) if body in points else _UNKNOWN_SOLE
        told = f"the lowest 4 mm of the surface of '{body}'"
        if body not in points:
            told = f"no surface of '{body}' was found: 22 x 8 cm, 5 cm under the ankle. MEASURE IT"
        notes.append(f"soles.{side}: {told}")
    return soles, notes


def _head(unprofiled: UnprofiledModel, path: Path, name: str, out: Path, rights: tuple[str, str]) -> list[str]:
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
