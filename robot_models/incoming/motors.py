"""Torque limits that an MJCF's actuators state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import mujoco


def motor_efforts(model: mujoco.MjModel) -> dict[str, float]:
    """Torque limits by joint [N m]: of an actuator's force, or of a motor's control, times the gear."""
    import mujoco

    found: dict[str, float] = {}
    for k in range(model.nu):
        if model.actuator_trntype[k] != mujoco.mjtTrn.mjTRN_JOINT:
            continue
        gear, most = abs(float(model.actuator_gear[k, 0])), 0.0
        if model.actuator_forcelimited[k]:
            most = float(np.abs(model.actuator_forcerange[k]).max())
        elif model.actuator_ctrllimited[k] and model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_NONE:
            most = float(np.abs(model.actuator_ctrlrange[k]).max() * abs(model.actuator_gainprm[k, 0]))
        if most > 0.0:
            found[model.joint(int(model.actuator_trnid[k, 0])).name] = most * gear
    return found
