"""Dynamics of so many frames with given missing forces, moments, torques and touches; all else as in a quiet stand."""

import numpy as np

from retarget.dynamics.inverse_dynamics import Dynamics
from retarget.rules import DynamicsConfig

WEIGHT, POINTS = 500.0, 8


def dynamics_by_hand(frames, fps=50.0, *, force=None, moment=None, effort=None, in_contact=None, com_z=None, lift=None):
    """Force and moment (T, 3) in their gates, effort (T,) as a share beyond the motor's in its gate, lift (T,) [weights]."""
    zeros = np.zeros((frames, 3))
    residual = np.concatenate(
        (
            (zeros if force is None else force) * DynamicsConfig().force_gate * WEIGHT,
            (zeros if moment is None else moment) * DynamicsConfig().moment_gate * WEIGHT,
        ),
        axis=1,
    )
    net = np.zeros((frames, 6))
    net[:, 2] = WEIGHT if lift is None else WEIGHT * lift
    com = np.zeros((frames, 3))
    com[:, 2] = 0.9 if com_z is None else com_z
    return Dynamics(
        fps=fps, joint_names=("knee",), weight=WEIGHT, joint_torque=np.zeros((frames, 1)),
        in_contact=np.ones((frames, POINTS), dtype=bool) if in_contact is None else np.repeat(in_contact[:, None], POINTS, axis=1),
        point_w=np.zeros((frames, POINTS, 3)), force_w=np.zeros((frames, POINTS, 3)),
        net_wrench_w=net, residual=residual, com_w=com,
        zmp_w=np.zeros((frames, 2)), zmp_outside=np.zeros(frames),
        effort_share=np.zeros(frames) if effort is None else 1.0 + DynamicsConfig().effort_gate * effort,
        worst_joint=("knee",) * frames, solve_error=np.zeros(frames),
    )  # fmt: skip
