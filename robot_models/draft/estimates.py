"""Numbers that a model file does not hold, guessed for a robot that nobody has measured; each guess says so."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robot_models.draft.limbs import Limbs
from robot_models.incoming import motor_efforts
from robot_models.profile import FEET

if TYPE_CHECKING:
    import mujoco

_STANDING = 2.5  # kp over the torque per radian at which a falling robot, or a hanging limb, balances
_DAMPING_S = 0.04  # kd over kp [s], as in the talos profile
_ROTOR = 0.02  # armature where the file has none [kg m^2]
_SPEED = 10.0  # speed limit where the file has none [rad/s]
_LEAST_KP = 5.0  # [N m/rad]
# Torque where the file has none. Of nine robots whose makers tell it, knees have 0.6 of the weight times the height of its centre,
# shoulders four times what holds the arm out and more, elbows 0.03 of the weight times that height and more.
_LEG_TORQUE = 0.3  # of kp [rad]
_ARM_TORQUE = 1.6  # of kp [rad]
_LEAST_TORQUE = 0.03  # of the weight times the height
_UNLIKE = 0.3  # difference of left and right ranges that is doubted [rad]
_BEND = 0.3  # of the knees in the default pose [rad]
_PITCH = 0.8  # of an axis that turns about y: hips are tilted by up to 30 degrees
_MOST_LEAN = 0.25  # of the legs in it [rad]
_GRAVITY = 9.81


@dataclass(frozen=True, kw_only=True, eq=False)
class UnprofiledModel:
    """A robot without a profile, at zero: `data` holds its kinematics there."""

    model: mujoco.MjModel
    data: mujoco.MjData
    limbs: Limbs
    landmarks: Mapping[str, str]  # landmark -> body

    def joint_of(self, body: str) -> str:
        """The joint that moves a body."""
        return str(self.model.joint(int(self.model.body_jntadr[self.model.body(body).id])).name)

    @property
    def loose(self) -> list[str]:
        """Joints of fingers, grippers and toes."""
        return [self.joint_of(b) for b in self.limbs.loose]

    @property
    def joints(self) -> list[str]:
        """All others but the root's, in the file's order."""
        names = [self.model.joint(j).name for j in range(1, self.model.njnt)]
        return [n for n in names if n not in self.loose]


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Values by joint, what is said about them, and which tables hold anything that the file does not."""

    tables: Mapping[str, Mapping[str, float]]
    notes: tuple[str, ...]
    guessed: frozenset[str]


def estimate_servos(unprofiled: UnprofiledModel, height: float, path: Path) -> Estimate:
    """Gains, armature, effort and speed limits of every joint.

    Args:
        unprofiled: the robot.
        height: of its centre of mass over the soles [m].
        path: the model file; a URDF tells speed limits, which MuJoCo does not keep.
    """
    model, data = unprofiled.model, unprofiled.data
    legs = {b for chain in unprofiled.limbs.legs.values() for b in chain}
    speeds, motors, weak, slow = _urdf_speeds(path), motor_efforts(model), [], []
    tables: dict[str, dict[str, float]] = {k: {} for k in ("kp", "kd", "armature", "effort", "velocity")}
    for name in unprofiled.joints:
        joint = model.joint(name)
        body, dof = int(joint.bodyid[0]), int(joint.dofadr[0])
        lever = float(np.linalg.norm(data.subtree_com[body] - data.xanchor[joint.id]))
        carried = float(model.body_subtreemass[body]) * lever
        if model.body(body).name in legs:  # it carries the whole robot
            carried = float(model.body_subtreemass[1]) * height
        kp = _two_digits(max(_STANDING * _GRAVITY * carried, _LEAST_KP))
        effort, speed = float(model.jnt_actfrcrange[joint.id][1]) or motors.get(name, 0.0), speeds.get(name, 0.0)
        if not effort > 0.0:
            arms = max(_ARM_TORQUE * kp, _LEAST_TORQUE * float(model.body_subtreemass[1]) * _GRAVITY * height)
            effort = _two_digits(_LEG_TORQUE * kp if model.body(body).name in legs else arms)
            weak.append(name)
        if not speed > 0.0:
            speed = _SPEED
            slow.append(name)
        armature = float(model.dof_armature[dof]) or _ROTOR
        row = {"kp": kp, "kd": _DAMPING_S * kp, "armature": armature, "effort": effort, "velocity": speed}
        for key, value in row.items():
            tables[key][name] = value
    notes = [
        f"kp: {_STANDING} x the weight that a joint carries x its lever: stands, gravity compensated",
        f"kd: {_DAMPING_S} s x kp",
        f"armature: {_ROTOR} kg m^2 where the file has none; the maker's rotor inertia x ratio^2 is better",
    ]
    notes += (
        [f"effort: none in the file for {', '.join(weak)}: as much as other humanoids' motors have for their weight"]
        if weak
        else []
    )
    notes += [f"velocity: none in the file for {', '.join(slow)}: {_SPEED:g} rad/s"] if slow else []
    guessed = {"kp", "kd", "armature"} | ({"effort"} if weak else set()) | ({"velocity"} if slow else set())
    return Estimate(tables=tables, notes=tuple(notes), guessed=frozenset(guessed))


def estimate_pose(unprofiled: UnprofiledModel, soles: Mapping[str, tuple[float, float]]) -> Estimate:
    """Knees a little bent, feet level, where a leg pitches about y, the mass between ankles and middle of the soles.

    Everything else stands at zero, or as near as it goes.

    Args:
        unprofiled: the robot.
        soles: back and front edge of each in its foot's frame [m].
    """
    angles, notes = dict.fromkeys(unprofiled.joints, 0.0), []
    leaning: list[tuple[str, str, float, float]] = []  # joints of hip and ankle, and their signs
    for side in FEET:
        chain = unprofiled.limbs.legs[side]
        knee = chain.index(unprofiled.landmarks[f"{side}_knee"])
        pitches = [_pitch(unprofiled, b) for b in chain]
        hip = next((k for k in range(knee) if pitches[k]), None)
        ankle = next((k for k in range(knee + 1, len(chain)) if pitches[k]), None)
        if hip is None or ankle is None or not pitches[knee]:
            notes.append(f"default_pose: the {side} leg stands straight: no hip, knee and ankle about y")
            continue
        for k, angle in ((hip, -0.5 * _BEND), (knee, _BEND), (ankle, -0.5 * _BEND)):
            angles[unprofiled.joint_of(chain[k])] = pitches[k] * angle
        leaning.append(
            (unprofiled.joint_of(chain[hip]), unprofiled.joint_of(chain[ankle]), pitches[hip], pitches[ankle])
        )
    lean = _lean(unprofiled, angles, soles) if len(leaning) == len(FEET) else 0.0
    for hip_joint, ankle_joint, at_hip, at_ankle in leaning:
        angles[hip_joint] += at_hip * lean
        angles[ankle_joint] -= at_ankle * lean
    for name, angle in angles.items():
        low, high = unprofiled.model.jnt_range[unprofiled.model.joint(name).id]
        angles[name] = float(np.clip(angle, low, high))
    over = f", legs leant by {lean:.2f} rad so that the mass is before the ankles" if lean else ""
    notes.append(f"default_pose: knees bent by {_BEND} rad{over}, the rest at zero, inside the ranges")
    return Estimate(tables={"default_pose": angles}, notes=tuple(notes), guessed=frozenset({"default_pose"}))


def _lean(unprofiled: UnprofiledModel, angles: Mapping[str, float], soles: Mapping[str, tuple[float, float]]) -> float:
    """How far the legs lean so that the mass is between the ankles and the middle of the soles [rad], trunk and soles level."""
    import mujoco

    model, data = unprofiled.model, mujoco.MjData(unprofiled.model)
    for name, angle in angles.items():
        data.qpos[int(model.joint(name).qposadr[0])] = angle
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    feet = {side: data.body(unprofiled.limbs.legs[side][-1]).xpos for side in FEET}
    ankles = float(np.mean([feet[side][0] for side in FEET]))
    middle = ankles + float(np.mean([0.5 * sum(soles[side]) for side in FEET]))
    com = float(data.subtree_com[1][0])
    low, high = sorted((0.5 * (ankles + middle), middle))
    wanted = min(max(com, low), high)
    hips = float(np.mean([data.body(unprofiled.landmarks[f"{side}_hip"]).xpos[2] - feet[side][2] for side in FEET]))
    return float(np.clip((wanted - com) / max(hips, 0.1), -_MOST_LEAN, _MOST_LEAN))


def doubted_ranges(unprofiled: UnprofiledModel) -> list[str]:
    """Left and right of one robot have the same ranges, mirrored for axes that lie ahead or upright."""
    notes = []
    for chains in (unprofiled.limbs.legs, unprofiled.limbs.arms):
        for left, right in zip(chains["left"], chains["right"], strict=False):
            names = unprofiled.joint_of(left), unprofiled.joint_of(right)
            ids = [unprofiled.model.joint(n).id for n in names]
            axes, ranges = unprofiled.data.xaxis[ids], unprofiled.model.jnt_range[ids]
            same = float(np.dot(axes[0], axes[1] * [-1.0, 1.0, -1.0])) > 0.0
            off = float(np.abs(ranges[0] - (ranges[1] if same else -ranges[1][::-1])).max())
            if off > _UNLIKE:
                notes.append(
                    f"ranges in the model file: {names[0]}'s and {names[1]}'s differ by {off:.2f} rad: a fault?"
                )
    return notes


def _pitch(unprofiled: UnprofiledModel, body: str) -> int:
    """1 or -1 where the body's joint turns about y or -y, else 0."""
    axis = unprofiled.data.xaxis[unprofiled.model.joint(unprofiled.joint_of(body)).id]
    return int(np.sign(axis[1])) if abs(axis[1]) > _PITCH else 0


def _urdf_speeds(path: Path) -> dict[str, float]:
    """Speed limits by joint; {} for an MJCF, which has none."""
    found = {}
    for joint in ET.parse(path).getroot().findall("joint"):
        limit = joint.find("limit")
        if limit is not None:
            found[joint.get("name", "")] = float(limit.get("velocity", "0"))
    return found


def _two_digits(value: float) -> float:
    """Nobody knows a gain better."""
    return float(f"{value:.2g}")
