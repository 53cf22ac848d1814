"""Motors that turn slower the harder they pull: the torque-speed envelope, on MuJoCo's own DC motor.

Full torque up to the knee speed, from there a straight line down to none at the no-load speed; against the motion a motor
brakes with all it has. That is a servo whose voltage is limited: MuJoCo's `dcmotor` with a position controller, which is
the position servo to the last digit while the limit is not reached.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

if TYPE_CHECKING:
    import mujoco

_R, _K, _KP, _KD, _VMAX = 0, 1, 4, 6, 7  # places in a dcmotor's gainprm
_POSITION_INPUT = 1  # of mjtCtrlInput


def limit_torque_by_speed(model: mujoco.MjModel, knee: Float[ndarray, "J"], no_load: Float[ndarray, "J"]) -> None:
    """Give the position servos of a model, in place, an envelope.

    Args:
        model: with position servos whose force is limited.
        knee: speed up to which a motor has its full torque [rad/s].
        no_load: speed at which it has none left [rad/s].
    """
    import mujoco

    kp, kd = servo_gains(model)
    effort = model.actuator_forcerange[:, 1]
    model.actuator_gaintype[:] = mujoco.mjtGain.mjGAIN_DCMOTOR
    model.actuator_biastype[:] = mujoco.mjtBias.mjBIAS_DCMOTOR
    model.actuator_dyntype[:] = mujoco.mjtDyn.mjDYN_DCMOTOR
    model.actuator_ctrlspec[:] = _POSITION_INPUT
    model.actuator_gainprm[:], model.actuator_biasprm[:], model.actuator_dynprm[:] = 0.0, 0.0, 0.0
    # With a motor constant of one, voltage is speed, and 1 / resistance the slope of torque over speed.
    model.actuator_gainprm[:, _K] = 1.0
    model.actuator_gainprm[:, _R] = (no_load - knee) / effort
    model.actuator_gainprm[:, _VMAX] = no_load
    model.actuator_gainprm[:, _KP], model.actuator_gainprm[:, _KD] = kp, kd


def servo_gains(model: mujoco.MjModel) -> tuple[Float[ndarray, "J"], Float[ndarray, "J"]]:
    """Stiffness [N m/rad] and damping [N m s/rad] of a model's servos, of either kind."""
    if _limited(model):
        return np.array(model.actuator_gainprm[:, _KP]), np.array(model.actuator_gainprm[:, _KD])
    return np.array(model.actuator_gainprm[:, 0]), -np.array(model.actuator_biasprm[:, 2])


def torque_limits(
    model: mujoco.MjModel, speed: Float[ndarray, "*N J"]
) -> tuple[Float[ndarray, "*N J"], Float[ndarray, "*N J"]]:
    """Least and largest torque [N m] of a model's motors at these speeds [rad/s], for engines without such motors."""
    effort = model.actuator_forcerange[:, 1]
    if not _limited(model):
        return np.broadcast_to(-effort, speed.shape), np.broadcast_to(effort, speed.shape)
    resistance, voltage = model.actuator_gainprm[:, _R], model.actuator_gainprm[:, _VMAX]
    lower, upper = (-voltage - speed) / resistance, (voltage - speed) / resistance
    return np.clip(lower, -effort, effort), np.clip(upper, -effort, effort)


def _limited(model: mujoco.MjModel) -> bool:
    import mujoco

    return bool(model.actuator_gaintype[0] == mujoco.mjtGain.mjGAIN_DCMOTOR)
