"""A profile for a robot that has none: drafted from its model file, every guess marked and named."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robot_models.build import BODY_BIT, build_robot
from robot_models.errors import RobotError
from robot_models.hulls import capsules_of, sole_of, surface_points
from robot_models.limbs import Limbs, find_limbs, joint_centre, middle_joint
from robot_models.profile import FEET, LANDMARKS, Capsule, read_profile
from robot_models.source import open_spec

if TYPE_CHECKING:
    import mujoco

_STANDING = 2.5  # kp over the torque per radian at which a falling robot, or a hanging limb, balances
_DAMPING_S = 0.04  # kd over kp [s], as in the talos profile
_ROTOR = 0.02  # armature where the file has none [kg m^2]
_SPEED = 10.0  # speed limit where the file has none [rad/s]
_UNLIKE = 0.3  # difference of left and right ranges that is doubted [rad]
_BEND = 0.3  # of the knees in the default pose [rad]
_GRAVITY = 9.81


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A profile's text, and what a person has to look at."""

    text: str
    guesses: tuple[str, ...]


def draft_profile(path: Path, name: str, out: Path) -> Draft:
    """Draft the profile of a URDF or MJCF humanoid.

    Args:
        path: the model file.
        name: of the robot.
        out: where the profile will stand, for the model's path in it.

    Raises:
        RobotError: no humanoid, or one that does not stand along z and face +x at zero; joints without limits.
    """
    import mujoco

    spec = open_spec(path, repair=True)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    limbs = find_limbs(model, data, str(path))
    landmarks = limbs.landmarks
    for side in FEET:
        leg, arm = limbs.legs[side], limbs.arms[side]
        landmarks |= {f"{side}_hip": joint_centre(model, data, leg), f"{side}_knee": middle_joint(data, leg)}
        landmarks |= {f"{side}_shoulder": joint_centre(model, data, arm), f"{side}_elbow": middle_joint(data, arm)}
    bodies = [model.body(b).name for b in range(1, model.nbody) if model.body_jntnum[b]]
    points = surface_points(path, bodies)
    _check_stance(model, data, limbs, landmarks, points, path)
    drawing = _Drawing(path, name, out, model, data, limbs, landmarks)
    drawing.soles({s: sole_of(points[limbs.legs[s][-1]]) if limbs.legs[s][-1] in points else None for s in FEET})
    bare = not any(model.geom_contype[g] for g in range(model.ngeom))
    drawing.capsules(capsules_of(points, [b for b in bodies if b not in limbs.loose]) if bare else [])
    return Draft(text=drawing.text(), guesses=tuple(drawing.guesses))


def without_overlaps(draft: Draft, out: Path) -> Draft:
    """The draft with those pairs of bodies excluded that overlap already where the robot stands.

    Args:
        draft: written to `out` before.
        out: its file.
    """
    import mujoco

    robot = build_robot(read_profile(out))
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
    if not pairs:
        return draft
    rows = "".join(f'  ["{a}", "{b}"],\n' for a, b in sorted(pairs))
    note = f"excludes: {len(pairs)} pairs of bodies overlap already where the robot stands"
    text = draft.text.replace(
        "excludes = []\n", f"# GUESSED: they overlap where the robot stands\nexcludes = [\n{rows}]\n"
    )
    return Draft(text=text, guesses=(*draft.guesses, note))


def _check_stance(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    limbs: Limbs,
    landmarks: dict[str, str],
    points: dict[str, np.ndarray],
    path: Path,
) -> None:
    """At zero the robot shall stand along z and face +x, its feet's axes the world's."""

    def at(body: str) -> np.ndarray:
        return np.array(data.body(body).xpos)

    leg = at(landmarks["left_hip"]) - at(limbs.legs["left"][-1])
    if leg[2] < 0.8 * np.linalg.norm(leg):
        raise RobotError(
            str(path), found=f"hips over feet by {leg[0]:.2f}, {leg[1]:.2f}, {leg[2]:.2f} m along x, y, z at zero",
            expected="a robot that stands along z", cure="turn its root body in the model file",
        )  # fmt: skip
    foot = limbs.legs["left"][-1]
    if not np.allclose(data.body(foot).xmat.reshape(3, 3), np.eye(3), atol=0.02):
        raise RobotError(
            str(path), found=f"axes of '{foot}' that are not the world's at zero", expected="x ahead, z up, as for a sole",
            cure="turn the body's frame in the model file",
        )  # fmt: skip
    if foot in points:
        ahead = float(np.mean([points[foot][:, 0].max(), points[foot][:, 0].min()]))
        if ahead < 0.0 and abs(ahead) > 0.01:
            raise RobotError(
                str(path), found=f"soles that reach {-100 * ahead:.0f} cm further back than ahead of the ankle",
                expected="a robot that faces +x at zero", cure="turn its root body by half a turn in the model file",
            )  # fmt: skip
    several = [model.body(b).name for b in range(1, model.nbody) if model.body_jntnum[b] > 1]
    if several:
        raise RobotError(
            str(path), found=f"several joints on {', '.join(several)}", expected="one joint per body",
            cure="give each joint a body of its own",
        )  # fmt: skip
    free = [model.joint(j).name for j in range(1, model.njnt) if not model.jnt_limited[j]]
    if free:
        raise RobotError(
            str(path), found=f"no position limit for {', '.join(free)}", expected="a range for every joint",
            cure="write the ranges into the model file",
        )  # fmt: skip


class _Drawing:
    """Collects the entries of a profile and what was guessed about them."""

    def __init__(
        self, path: Path, name: str, out: Path, model: mujoco.MjModel, data: mujoco.MjData, limbs: Limbs,
        landmarks: dict[str, str],
    ) -> None:  # fmt: skip
        self.guesses: list[str] = []
        self._model, self._data, self._limbs, self._landmarks = model, data, limbs, landmarks
        loose = [model.joint(int(model.body_jntadr[model.body(b).id])).name for b in limbs.loose]
        self._joints = [model.joint(j).name for j in range(1, model.njnt) if model.joint(j).name not in loose]
        self._mass = float(model.body_subtreemass[1])
        self._speeds = _urdf_speeds(path)
        try:
            where = path.resolve().relative_to(out.resolve().parent)
        except ValueError:
            where = path.resolve()
        title = f"{name}, {len(self._joints)} joints"
        self._head = [
            f"# Drafted from {path.name}. Lines marked GUESSED are not in that file: look at each of them.",
            f'name = "{name}"', f'title = "{title}"', f'root = "{model.body(1).name}"', "friction = 0.8",
            f"freeze = {_listed(loose)}" if loose else "", "excludes = []", "",
            "[source]", f'path = "{where.as_posix()}"', 'licence = "unknown: look it up before you pass it on"',
            f'origin = "{path.name}"', 'inertia = "repair"',
        ]  # fmt: skip
        self._say("friction", "0.8, rubber on a hall floor")
        if loose:
            self._say("freeze", f"{len(loose)} joints of fingers, grippers or toes are held at zero")

    def _say(self, entry: str, why: str) -> None:
        self.guesses.append(f"{entry}: {why}")

    def soles(self, soles: dict[str, tuple[tuple[float, float], tuple[float, float], float] | None]) -> None:
        """The flat patches under the feet."""
        self._soles = []
        for side, sole in soles.items():
            body = self._limbs.legs[side][-1]
            if sole is None:
                sole = ((-0.08, 0.14), (-0.04, 0.04), -0.05)
                self._say(
                    f"soles.{side}", f"no surface of '{body}' was found: 22 x 8 cm, 5 cm under the ankle. MEASURE IT"
                )
            else:
                self._say(f"soles.{side}", f"the lowest {1000 * 0.004:.0f} mm of the surface of '{body}'")
            (x0, x1), (y0, y1), z = sole
            corners = ", ".join(f"[{x:.4f}, {y:.4f}]" for x in (x0, x1) for y in (y0, y1))
            self._soles += [
                f"[soles.{side}]  # GUESSED", f'body = "{body}"', f"x = [{x0:.4f}, {x1:.4f}]", f"y = [{y0:.4f}, {y1:.4f}]",
                f"z = {z:.4f}", f"points = [{corners}]",
            ]  # fmt: skip
        self._height = float(self._data.subtree_com[1][2] - self._data.body(self._limbs.legs["left"][-1]).xpos[2]) - z

    def capsules(self, capsules: list[Capsule]) -> None:
        """Self-collision shapes, where the file has only meshes."""
        self._capsules = []
        for c in capsules:
            self._capsules += [
                f"[capsules.{c.name}]", f'body = "{c.body}"', f"from = {list(c.start)}", f"to = {list(c.end)}",
                f"radius = {c.radius}",
            ]  # fmt: skip
        if capsules:
            self._say("capsules", f"{len(capsules)} around the meshes, one per body")

    def _numbers(self) -> list[str]:
        """Gains, armature, effort and speed of every joint."""
        model, table = self._model, {k: dict[str, float]() for k in ("kp", "kd", "armature", "effort", "velocity")}
        legs = {b for chain in self._limbs.legs.values() for b in chain}
        weak, slow = [], []
        for name in self._joints:
            joint = model.joint(name)
            body, dof = int(joint.bodyid[0]), int(joint.dofadr[0])
            carried = self._mass * self._height
            if model.body(body).name not in legs:
                arm = float(np.linalg.norm(self._data.subtree_com[body] - self._data.xanchor[joint.id]))
                carried = float(model.body_subtreemass[body]) * arm
            kp = _round(max(_STANDING * _GRAVITY * carried, 5.0))
            effort = float(model.jnt_actfrcrange[joint.id][1])
            if not effort > 0.0:
                effort = _round(0.3 * kp)
                weak.append(name)
            speed = self._speeds.get(name, 0.0)
            if not speed > 0.0:
                speed = _SPEED
                slow.append(name)
            armature = float(model.dof_armature[dof]) or _ROTOR
            row = {"kp": kp, "kd": _DAMPING_S * kp, "armature": armature, "effort": effort, "velocity": speed}
            for key, value in row.items():
                table[key][name] = value
        self._say("kp", f"{_STANDING} x the weight that a joint carries x its lever: stands, gravity compensated")
        self._say("kd", f"{_DAMPING_S} s x kp")
        self._say("armature", f"{_ROTOR} kg m^2 where the file has none; the maker's rotor inertia x ratio^2 is better")
        if weak:
            self._say("effort", f"none in the file for {', '.join(weak)}: 0.3 rad x kp")
        if slow:
            self._say("velocity", f"none in the file for {', '.join(slow)}: {_SPEED:g} rad/s")
        guessed = {"kp", "kd", "armature"} | ({"effort"} if weak else set()) | ({"velocity"} if slow else set())
        lines = []
        for key, values in table.items():
            lines.append(f"[joints.{key}]" + ("  # GUESSED" if key in guessed else ""))
            lines += [f'"{n}" = {float(f"{v:.6g}")!r}' for n, v in values.items()]
        return lines

    def _pose(self) -> list[str]:
        """Knees a little bent, feet level, where a leg pitches about y; everything else at zero, or as near as it goes."""
        angles = dict.fromkeys(self._joints, 0.0)
        for side in FEET:
            chain = self._limbs.legs[side]
            knee = chain.index(self._landmarks[f"{side}_knee"])
            pitches = [self._pitch(b) for b in chain]
            hip = next((k for k in range(knee) if pitches[k]), None)
            ankle = next((k for k in range(knee + 1, len(chain)) if pitches[k]), None)
            if hip is None or ankle is None or not pitches[knee]:
                self._say("default_pose", f"the {side} leg stands straight: no hip, knee and ankle about y")
                continue
            for k, angle in ((hip, -0.5 * _BEND), (knee, _BEND), (ankle, -0.5 * _BEND)):
                angles[self._joint_of(chain[k])] = pitches[k] * angle
        for name, angle in angles.items():
            low, high = self._model.jnt_range[self._model.joint(name).id]
            angles[name] = float(np.clip(angle, low, high))
        self._say("default_pose", f"knees bent by {_BEND} rad, the rest at zero, inside the ranges")
        return ["[default_pose]  # GUESSED", *(f'"{n}" = {a:.4f}' for n, a in angles.items() if a)]

    def _doubt_ranges(self) -> None:
        """Left and right of one robot have the same ranges, mirrored for axes that lie ahead or upright."""
        for chains in (self._limbs.legs, self._limbs.arms):
            for left, right in zip(chains["left"], chains["right"], strict=False):
                names = self._joint_of(left), self._joint_of(right)
                axes = [self._data.xaxis[self._model.joint(n).id] for n in names]
                ranges = [self._model.jnt_range[self._model.joint(n).id] for n in names]
                mirrored = axes[1] * [-1.0, 1.0, -1.0]
                same = float(np.dot(axes[0], mirrored)) > 0.0
                other = ranges[1] if same else -ranges[1][::-1]
                off = float(np.abs(ranges[0] - other).max())
                if off > _UNLIKE:
                    self._say(
                        "ranges in the model file",
                        f"{names[0]}'s and {names[1]}'s differ by {off:.2f} rad: a fault?",
                    )

    def _joint_of(self, body: str) -> str:
        return str(self._model.joint(int(self._model.body_jntadr[self._model.body(body).id])).name)

    def _pitch(self, body: str) -> int:
        """1 or -1 where the body's joint turns about y or -y, else 0."""
        axis = self._data.xaxis[int(self._model.body_jntadr[self._model.body(body).id])]
        return int(np.sign(axis[1])) if abs(axis[1]) > 0.95 else 0

    def text(self) -> str:
        """The whole file."""
        self._doubt_ranges()
        marks = [f'{k} = "{self._landmarks[k]}"' for k in LANDMARKS]
        tracked = [self._limbs.pelvis]
        tracked += [self._landmarks[f"{s}_{p}"] for s in FEET for p in ("hip", "knee", "foot")]
        tracked += [self._limbs.torso]
        tracked += [self._landmarks[f"{s}_{p}"] for s in FEET for p in ("shoulder", "elbow", "wrist")]
        site = next(
            (self._model.site(i).name for i in range(self._model.nsite) if "imu" in self._model.site(i).name.lower()),
            "",
        )
        blocks = [
            [line for line in self._head if line or line == ""], self._numbers(), self._pose(), self._soles, self._capsules,
            ["[landmarks]  # GUESSED from the tree", *marks],
            ["[tracking]", f'anchor = "{self._limbs.torso}"', f'imu = "{site}"', f"bodies = {_listed(tracked)}"],
        ]  # fmt: skip
        return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _urdf_speeds(path: Path) -> dict[str, float]:
    """Speed limits by joint, which MuJoCo does not keep; {} for an MJCF, which has none."""
    tree = ET.parse(path).getroot()
    found = {}
    for joint in tree.findall("joint"):
        limit = joint.find("limit")
        if limit is not None:
            found[joint.get("name", "")] = float(limit.get("velocity", "0"))
    return found


def _round(value: float) -> float:
    """Two digits: nobody knows a gain better."""
    return float(f"{value:.2g}")


def _listed(names: list[str]) -> str:
    unique = list(dict.fromkeys(names))
    return "[\n" + "".join(f'  "{n}",\n' for n in unique) + "]"
