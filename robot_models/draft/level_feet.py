"""Feet level in a standing pose: hips that are tilted turn a bent leg's foot, and the leg's other joints turn it back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy import ndarray

from robot_models.draft.estimates import Estimate, UnprofiledModel
from robot_models.maths import rotation as rot
from robot_models.profile import FEET

_LEVEL = 1e-4  # rad that a foot may be turned by
_STIFF = 1e-3  # weight of a joint's way against a foot's turn


def levelled(unprofiled: UnprofiledModel, pose: Estimate) -> Estimate:
    """The default pose with both feet level.

    Args:
        unprofiled: the robot.
        pose: as estimated, its table `default_pose`.
    """
    angles = dict(pose.tables["default_pose"])
    return replace(pose, tables={"default_pose": {**angles, **level_feet(unprofiled, angles)}})


def level_feet(unprofiled: UnprofiledModel, angles: Mapping[str, float]) -> dict[str, float]:
    """The angles of the legs with both feet turned as at zero; as they are where that is so, or cannot be.

    Args:
        unprofiled: the robot.
        angles: of all joints [rad].
    """
    import mujoco
    from scipy.optimize import least_squares

    model, data = unprofiled.model, mujoco.MjData(unprofiled.model)
    found: dict[str, float] = {}
    for side in FEET:
        chain = unprofiled.limbs.legs[side]
        foot, knee = model.body(chain[-1]).id, chain.index(unprofiled.landmarks[f"{side}_knee"])
        names = [unprofiled.joint_of(b) for k, b in enumerate(chain) if k != knee]
        level = np.array(unprofiled.data.xquat[foot])
        start = np.array([angles[n] for n in names])
        low, high = model.jnt_range[[model.joint(n).id for n in names]].T

        def off(joints: ndarray, names: list[str] = names, foot: int = foot, level: ndarray = level) -> ndarray:
            for name, angle in {**angles, **dict(zip(names, joints, strict=True))}.items():
                data.qpos[int(model.joint(name).qposadr[0])] = angle
            mujoco.mj_kinematics(model, data)
            return np.asarray(rot.log(rot.multiply(data.xquat[foot], rot.conjugate(level))))

        if np.linalg.norm(off(start)) < _LEVEL:
            continue

        def cost(joints: ndarray, start: ndarray = start, off: Callable[[ndarray], ndarray] = off) -> ndarray:
            return np.concatenate((off(joints), _STIFF * (joints - start)))

        solved = least_squares(cost, np.clip(start, low + 1e-6, high - 1e-6), bounds=(low, high)).x
        if np.linalg.norm(off(solved)) < 0.1 * np.linalg.norm(off(start)):
            found |= {n: float(a) for n, a in zip(names, solved, strict=True)}
    return found
