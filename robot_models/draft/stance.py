"""How a robot stands at zero: which way up, facing where, on which soles; and what it is turned by for that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.draft.estimates import UnprofiledModel
from robot_models.draft.hulls import sole_of, surface_points
from robot_models.draft.limbs import find_limbs, joint_centre, middle_joint
from robot_models.errors import RobotError
from robot_models.incoming import turns_of
from robot_models.maths import rotation as rot
from robot_models.model_file import open_spec
from robot_models.profile import FEET

if TYPE_CHECKING:
    import mujoco

Sole = tuple[tuple[float, float], tuple[float, float], float]
"""Back and front edge, right and left edge, height [m]."""

FACES = {270: "+y", 180: "-x", 90: "-y"}
"""By how many degrees a robot is turned -> where it faces in its file."""
_UPRIGHT = 0.99995  # of the cosine of half a turn: 1 degree
_AHEAD = 0.01  # that feet reach further ahead of the ankle than behind it, where it can be told [m]
_SHORTEST, _NARROWEST, _THICK = 0.06, 0.02, 0.02  # of a sole that is flat; the skin of one that is not [m]
_UNKNOWN_SOLE: Sole = ((-0.08, 0.14), (-0.04, 0.04), -0.05)


def stood_up(path: Path) -> tuple[UnprofiledModel, dict[str, Float[ndarray, "4"]], float]:
    """The robot as it stands at zero, facing +x, with the axes of its root and its feet the world's.

    Returns:
        The robot; by what the frames of which bodies were turned for it; and by how much it was turned to face +x [rad].
    """
    asis = _open(path)
    feet = [asis.limbs.legs[side][-1] for side in FEET]
    yaw = -_facing(asis, surface_points(path, feet))
    turns = turns_of(asis.model, (asis.model.body(1).name, *feet), yaw)
    turns = {name: turn for name, turn in turns.items() if abs(turn[0]) < _UPRIGHT}
    return (_open(path, tuple(turns), yaw), turns, yaw) if turns else (asis, {}, 0.0)


def _facing(unprofiled: UnprofiledModel, feet: Mapping[str, Float[ndarray, "V 3"]]) -> float:
    """Where the robot faces at zero, in quarter turns from +x [rad]: where its feet reach further from their ankles.

    What one foot reaches to its side, the other reaches to its own.
    """
    data, ways = unprofiled.data, []
    for body, points in feet.items():
        turn = np.broadcast_to(data.body(body).xquat, (len(points), 4))
        out = rot.rotate(turn, points)
        ways.append(0.5 * (out.max(axis=0) + out.min(axis=0))[:2])
    way = np.mean(ways, axis=0) if ways else np.zeros(2)
    quarters = round(float(np.arctan2(way[1], way[0])) / (0.5 * np.pi)) % 4
    return 0.5 * np.pi * (quarters if quarters < 3 else -1) if np.linalg.norm(way) > _AHEAD else 0.0


def _open(path: Path, upright: tuple[str, ...] = (), yaw: float = 0.0) -> UnprofiledModel:
    import mujoco

    try:
        model = open_spec(path, repair=True, upright=upright, yaw=yaw).compile()
    except ValueError as e:
        raise RobotError(str(path), found=f"a model that MuJoCo cannot compile ({e})", expected="a robot") from e
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    try:
        limbs = find_limbs(model, data, str(path))
    except RobotError as e:
        raise faults_without_limbs(path, e) from None
    landmarks = limbs.landmarks
    for side in FEET:
        leg, arm = limbs.legs[side], limbs.arms[side]
        knee, elbow = (middle_joint(model, data, chain) for chain in (leg, arm))
        landmarks |= {f"{side}_hip": joint_centre(model, data, leg), f"{side}_knee": knee}
        landmarks |= {f"{side}_shoulder": joint_centre(model, data, arm), f"{side}_elbow": elbow}
    return UnprofiledModel(model=model, data=data, limbs=limbs, landmarks=landmarks)


def check_stance(unprofiled: UnprofiledModel, points: Mapping[str, Float[ndarray, "V 3"]], path: Path) -> None:
    """At zero the robot shall stand along z and face +x, all joints with ranges, every foot beyond its knee.

    Raises:
        RobotError: it does not; every fault is told at once.
    """
    model, data, foot = unprofiled.model, unprofiled.data, unprofiled.limbs.legs["left"][-1]
    leg = np.array(data.body(unprofiled.landmarks["left_hip"]).xpos - data.body(foot).xpos)
    reach = float(np.mean([points[foot][:, 0].max(), points[foot][:, 0].min()])) if foot in points else 0.0
    kneeless = [s for s in FEET if unprofiled.landmarks[f"{s}_knee"] == unprofiled.limbs.legs[s][-1]]
    faults = [
        (leg[2] < 0.8 * np.linalg.norm(leg), f"hips over feet by {leg[0]:.2f}, {leg[1]:.2f}, {leg[2]:.2f} m along x, y, z at zero",
         "a robot that stands along z", "turn its root body in the model file"),
        (reach < -0.01, f"soles that reach {-100 * reach:.0f} cm further back than ahead of the ankle",
         "a robot that faces +x at zero", "turn its root body by half a turn in the model file"),
        (bool(kneeless), f"the {' and the '.join(kneeless)} knee at the end of its limb", "a foot beyond it",
         "give the foot a body of its own in the model file, on a joint with a small range"),
    ]  # fmt: skip
    faults.append(_without_range(model, unprofiled.joints))
    _refuse(path, [fault[1:] for fault in faults if fault[0]])


def faults_without_limbs(path: Path, refusal: RobotError) -> RobotError:
    """The refusal of a robot whose limbs were not found, with what is wrong beside that."""
    model = open_spec(path, repair=True).compile()
    joints = [model.joint(j).name for j in range(1, model.njnt)]
    missing, *said = _without_range(model, joints)
    if not missing:
        return refusal
    found, expected, cure = said
    return RobotError(
        refusal.where, found=f"{refusal.found}; and {found}", expected=f"{refusal.expected}; and {expected}",
        cure="; ".join(part for part in (refusal.cure, cure) if part),
    )  # fmt: skip


def _without_range(model: mujoco.MjModel, joints: Sequence[str]) -> tuple[bool, str, str, str]:
    free = [n for n in joints if not model.jnt_limited[model.joint(n).id]]
    return (
        bool(free), f"no position limit for {', '.join(free)}", "a range for every joint", "write the ranges into the model file",
    )  # fmt: skip


def _refuse(path: Path, faults: Sequence[tuple[str, str, str]]) -> None:
    """Refuse a robot for all that is wrong with it.

    Raises:
        RobotError: there is any.
    """
    if faults:
        found, expected, cure = ("; and ".join(said) for said in zip(*faults, strict=True))
        raise RobotError(str(path), found=found, expected=expected, cure=cure)


def soles_of(
    unprofiled: UnprofiledModel, points: Mapping[str, Float[ndarray, "V 3"]]
) -> tuple[dict[str, Sole], list[str]]:
    """The soles of both feet, and how each was come by."""
    soles, notes = {}, []
    for side in FEET:
        body = unprofiled.limbs.legs[side][-1]
        soles[side] = sole_of(points[body]) if body in points else _UNKNOWN_SOLE
        told = f"the lowest 4 mm of the surface of '{body}'"
        if body not in points:
            told = f"no surface of '{body}' was found: 22 x 8 cm, 5 cm under the ankle. MEASURE IT"
        elif min(np.ptp(soles[side][0]) - _SHORTEST, np.ptp(soles[side][1]) - _NARROWEST) < 0.0:
            soles[side] = sole_of(points[body], _THICK)
            told = f"the lowest 2 cm of the surface of '{body}', which is not flat at zero. MEASURE IT"
        notes.append(f"soles.{side}: {told}")
    return soles, notes
